// SPDX-License-Identifier: Apache-2.0
// recording.cpp - reads a recording wherever it is: in its HDF5 file or still in its log.
#include "io/record/recording.h"

#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <new>

#include "io/record/first_in_child.h"
#include "io/record/layout.h"
#include "io/record/log.h"
#include "io/record/to_hdf5.h"

namespace h6::io {
namespace fs = std::filesystem;
using namespace recording;

namespace {

// OUT, of OUT and of OUT.part.
fs::path file_of(const fs::path& name) {
  const fs::path file = followed(name);
  return file.extension() == ".part" ? file.parent_path() / file.stem() : file;
}

std::string last_time(const Recording& r) {
  if (r.frames.empty()) return "";
  char text[64];
  std::snprintf(text, sizeof text, " up to %.3f s", r.frames.back().time);
  return text;
}

// Reads through a temporary copy, while a run goes on or where its folder cannot be written.
Result<Recording> read_log(const File& log, FrameRange range) {
  static std::atomic<unsigned> counter{0};
  const fs::path copy = fs::temp_directory_path() / ("hapsix-" + std::to_string(::getpid()) + "-" +
                                                     std::to_string(counter++) + ".h5");
  Result<Recording> read = Failure{""};
  if (Outcome made = write_hdf5(log, copy); !made) {
    read = made.failure();
  } else {
    const LibraryLock lock;
    read = read_hdf5(copy, range);
  }
  ::unlink(copy.c_str());
  return read;
}

}  // namespace

std::size_t modes_of(const std::vector<RecordedBend>& bends) {
  std::size_t modes = 0;
  for (const RecordedBend& bend : bends) modes += bend.modes;
  return modes;
}

Result<Recording> read_recording(const fs::path& name, FrameRange range) {
  const fs::path file = file_of(name);
  try {
    const Result<std::string> repaired = repair_recording(file);
    const File log = open_log(part_of(file));
    Result<Recording> read = Failure{""};
    if (index_log(log)) {
      read = read_log(log, range);
    } else {
      const LibraryLock lock;
      // One frame leads through all that HDF5 looks up; the others are bytes at places that it
      // knows.
      const Outcome survives = first_in_child(file, "a recording", [&] {
        (void)read_hdf5(file, {range.first, 1});
      });
      read = survives ? read_hdf5(file, range) : survives.failure();
    }
    if (read && !read->whole)
      read->remark =
          "the run was killed, or is still going on: frames" + last_time(*read) + " are here";
    if (read && repaired && !repaired->empty()) read->remark = *repaired;
    return read;
  } catch (const std::bad_alloc&) {
    return Failure{file.string() + " needs more memory than there is: read it in pieces"};
  } catch (const std::exception& problem) {
    return Failure{"cannot read " + file.string() + ": " + problem.what()};
  }
}

Result<std::string> repair_recording(const fs::path& name) {
  const fs::path file = file_of(name);
  const auto shown = [](const fs::path& path) { return path.filename().string(); };
  try {
    const File log = open_log(part_of(file));
    if (!log.ok() || !log.lock()) return std::string();  // there is none, or a run writes it
    const std::optional<LogIndex> index = index_log(log);
    const std::string left = shown(part_of(file));
    if (!index) {
      fs::remove(part_of(file));
      return left + ", of a run that was killed before it recorded anything, was removed";
    }
    fs::path kept;
    if (Outcome made = publish(log, file, true, &kept); !made) return made.failure();
    return left + " with " + std::to_string(index->row_count) +
           " frames, left by a killed run, is " + shown(file) + " now" +
           (kept.empty() ? "" : "; the older " + shown(file) + " is kept as " + shown(kept));
  } catch (const std::exception& problem) {
    return Failure{"cannot repair " + file.string() + ": " + problem.what()};
  }
}

}  // namespace h6::io
