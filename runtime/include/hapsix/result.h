// SPDX-License-Identifier: Apache-2.0
// result.h - a value, or one sentence for a person. C++ only; for files, users and machines.
//
// The sentence says what is wrong, where, and what to do: it is printed as it stands.
#pragma once
#include <optional>
#include <string>
#include <utility>

namespace h6 {

struct Failure {
  std::string sentence;
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)) {}
  Result(Failure failure) : sentence_(std::move(failure.sentence)) {}

  explicit operator bool() const { return value_.has_value(); }
  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return &*value_; }
  const T* operator->() const { return &*value_; }
  const std::string& error() const { return sentence_; }
  Failure failure() const { return {sentence_}; }

 private:
  std::optional<T> value_;
  std::string sentence_;
};

struct Done {};
using Outcome = Result<Done>;  // success without a value: return Done{};

}  // namespace h6
