// SPDX-License-Identifier: Apache-2.0
#include "device/device_spec.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace h6::device {

Result<DeviceSpec> parse_device_spec(const std::string& text) {
  DeviceSpec spec;
  const std::size_t question = text.find('?');
  const std::string head = text.substr(0, question);
  const std::size_t colon = head.find(':');
  spec.name = head.substr(0, colon);
  if (colon != std::string::npos) spec.target = head.substr(colon + 1);
  if (question == std::string::npos) return spec;
  for (std::size_t at = question + 1; at <= text.size();) {
    const std::size_t end = std::min(text.find('&', at), text.size());
    const std::string pair = text.substr(at, end - at);
    const std::size_t equals = pair.find('=');
    if (equals == std::string::npos || equals == 0)
      return Failure{"'" + text + "': an option of a device is KEY=VALUE, not '" + pair + "'"};
    const std::string key = pair.substr(0, equals);
    for (const auto& [other, value] : spec.options)
      if (other == key) return Failure{"'" + text + "': the option '" + key + "' stands twice"};
    spec.options.emplace_back(key, pair.substr(equals + 1));
    at = end + 1;
  }
  return spec;
}

const std::string* OptionReader::take(const char* key) {
  known_.push_back(key);
  for (std::size_t i = 0; i < spec_.options.size(); ++i)
    if (spec_.options[i].first == key) {
      taken_[i] = true;
      return &spec_.options[i].second;
    }
  return nullptr;
}

void OptionReader::wrong(const char* key, const std::string& must, const std::string& value) {
  if (sentence_.empty())
    sentence_ = "the option '" + std::string(key) + "' of " + spec_.name + " must be " + must +
                ", not '" + value + "'";
}

void OptionReader::number(const char* key, double low, double high, double& value) {
  const std::string* text = take(key);
  if (!text) return;
  char* end = nullptr;
  const double parsed = std::strtod(text->c_str(), &end);
  if (!text->empty() && *end == '\0' && parsed >= low && parsed <= high) {
    value = parsed;
    return;
  }
  char must[80];
  std::snprintf(must, sizeof must, "a number from %g to %g", low, high);
  wrong(key, must, *text);
}

void OptionReader::whole(const char* key, unsigned long long high, unsigned long long& value) {
  const std::string* text = take(key);
  if (!text) return;
  const bool digits = !text->empty() && text->size() < 20 &&
                      text->find_first_not_of("0123456789") == std::string::npos;
  const unsigned long long parsed = digits ? std::strtoull(text->c_str(), nullptr, 10) : 0;
  if (digits && parsed <= high)
    value = parsed;
  else
    wrong(key, "a whole number from 0 to " + std::to_string(high), *text);
}

void OptionReader::yes_no(const char* key, bool& value) {
  const std::string* text = take(key);
  if (!text) return;
  if (*text == "yes" || *text == "no")
    value = *text == "yes";
  else
    wrong(key, "yes or no", *text);
}

void OptionReader::one_of(const char* key, const std::vector<std::string>& names,
                          std::string& value) {
  const std::string* text = take(key);
  if (!text) return;
  if (std::find(names.begin(), names.end(), *text) != names.end()) {
    value = *text;
    return;
  }
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i)
    list += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
  wrong(key, list, *text);
}

void OptionReader::text(const char* key, std::string& value) {
  if (const std::string* text = take(key)) value = *text;
}

Outcome OptionReader::finish() const {
  if (!sentence_.empty()) return Failure{sentence_};
  for (std::size_t i = 0; i < taken_.size(); ++i) {
    if (taken_[i]) continue;
    std::string list;
    for (const std::string& key : known_) list += (list.empty() ? "" : ", ") + key;
    return Failure{"the device '" + spec_.name + "' has no option '" + spec_.options[i].first +
                   "'" + (list.empty() ? ": it takes none" : "; it takes " + list)};
  }
  return Done{};
}

}  // namespace h6::device
