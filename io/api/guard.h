// SPDX-License-Identifier: Apache-2.0
// guard.h - the edge of the C functions: sentences and exceptions become an h6Error.
#pragma once
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <system_error>

#include "hapsix/io.h"
#include "hapsix/result.h"
#include "io/file/progress.h"

namespace h6::io {

// Whether this is the sentence of cancelled work (io/file/progress.h), and not one that names a
// file with that word in its name.
inline bool says_cancelled(const std::string& sentence) {
  return sentence == "cancelled" || sentence.ends_with(": cancelled");
}

inline void fill(h6Error* error, h6ErrorCode code, const std::string& sentence) {
  if (!error) return;
  std::snprintf(error->message, sizeof error->message, "%s", sentence.c_str());
  error->code = says_cancelled(sentence) ? H6_ERROR_CANCELLED : code;
}

// The code of a failure to read `file`.
inline h6ErrorCode reading(const char* file) {
  std::error_code error;
  return std::filesystem::is_regular_file(file, error) ? H6_ERROR_CONTENT : H6_ERROR_FILE;
}

// Calls work() and gives what it gives; `failed` where it throws.
template <class Work, class T>
T guarded(h6Error* error, T failed, Work&& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    fill(error, H6_ERROR_MEMORY, "out of memory: use a larger voxel or fewer points");
  } catch (const std::exception& e) {
    fill(error, H6_ERROR_SYSTEM, std::string("unexpected: ") + e.what());
  }
  return failed;
}

// An object of type Api around what a function of this library gave; null with `error` filled.
template <class Api, class T>
Api* wrap(Result<T> result, h6ErrorCode code, h6Error* error) {
  if (result) return new Api{std::move(*result)};
  fill(error, code, result.error());
  return nullptr;
}

inline bool finish(const Outcome& outcome, h6ErrorCode code, h6Error* error) {
  if (!outcome) fill(error, code, outcome.error());
  return static_cast<bool>(outcome);
}

template <class Sentences>
void log_all(const Sentences& sentences) {
  for (const std::string& sentence : sentences) h6Log(H6_LOG_WARNING, sentence.c_str());
}

inline Progress progress_of(h6Progress progress, void* user) {
  if (!progress) return {};
  return [progress, user](const std::string& what, double done) {
    return progress(user, what.c_str(), done);
  };
}

// Words that only a later version knows.
template <class Def>
bool understood(const Def& def, h6Error* error) {
  for (const std::uint64_t word : def.reserved)
    if (word != 0) {
      fill(
          error, H6_ERROR_ARGUMENT,
          "reserved is not zero: begin with the default function of the definition, or use a later "
          "version of hapsix");
      return false;
    }
  return true;
}

}  // namespace h6::io
