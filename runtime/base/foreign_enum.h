// SPDX-License-Identifier: Apache-2.0
// foreign_enum.h - enumerations that a C program passes.
#pragma once
#include <cstdint>
#include <cstring>

namespace h6 {

// The number behind `value`. C allows any, but C++ must not even read one that the enumeration
// cannot hold.
template <class Enum>
std::uint32_t raw_number(const Enum& value) {
  static_assert(sizeof(Enum) == sizeof(std::uint32_t));
  std::uint32_t number;
  std::memcpy(&number, &value, sizeof number);
  return number;
}

}  // namespace h6
