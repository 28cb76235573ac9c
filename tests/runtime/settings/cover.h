// SPDX-License-Identifier: Apache-2.0
// cover.h - proves that every member of a struct has its row of settings.
#pragma once
#include <doctest/doctest.h>

#include <cstddef>
#include <set>
#include <string>

#include "runtime/settings/setting.h"

namespace h6::test {

// Initialises any member: an aggregate takes as many of these as it has members.
struct Anything {
  template <class T>
  operator T() const;
};
// Members of an aggregate; an array counts as its elements.
template <class T, class... Found>
constexpr std::size_t member_count() {
  if constexpr (requires { T{Found{}..., Anything{}}; })
    return member_count<T, Found..., Anything>();
  else
    return sizeof...(Found);
}

template <class T>
constexpr std::size_t reserved_words() {
  if constexpr (requires(T def) { def.reserved; })
    return sizeof(T::reserved) / sizeof(std::uint64_t);
  else
    return 0;
}

// `others` members of T are no settings, beside `reserved`; the test that calls this says which.
template <class T>
void every_member_has_a_row(const SettingTable& rows, std::size_t others) {
  T def{};
  const auto* const begin = reinterpret_cast<const char*>(&def);
  std::set<const void*> places;
  std::size_t members = 0;
  for (const Setting& row : rows) {
    if (!row.member.make) continue;
    const void* const place = row.member.make(&def);
    INFO(std::string(rows.of), ".", std::string(row.name));
    CHECK(places.insert(place).second);
    CHECK(static_cast<const char*>(place) >= begin);
    CHECK(static_cast<const char*>(place) < begin + sizeof def);
    ++members;
  }
  INFO("every new member needs a row in the settings of ", std::string(rows.of));
  CHECK(members + others + reserved_words<T>() == member_count<T>());
}

}  // namespace h6::test
