// SPDX-License-Identifier: Apache-2.0
// device_spec.h - parses the name of a device on a command line or in a scene:
//
//   NAME[:TARGET][?KEY=VALUE[&KEY=VALUE...]]
//
//   spacemouse?speed=0.05&dominant=yes      plugin:./arm.so?host=10.0.0.7      bad-operator?seed=7
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "hapsix/result.h"

namespace h6::device {

struct DeviceSpec {
  std::string name, target;
  std::vector<std::pair<std::string, std::string>> options;  // in the order they were given
};

// Fails with a sentence when a key has no value or stands twice.
Result<DeviceSpec> parse_device_spec(const std::string& text);

// Reads options one by one into their values; an absent option leaves its value alone. finish()
// fails with a sentence about the first option that was wrong or is not known.
class OptionReader {
 public:
  explicit OptionReader(const DeviceSpec& spec) : spec_(spec), taken_(spec.options.size()) {}

  void number(const char* key, double low, double high, double& value);
  void whole(const char* key, unsigned long long high, unsigned long long& value);
  void yes_no(const char* key, bool& value);
  void one_of(const char* key, const std::vector<std::string>& names, std::string& value);
  void text(const char* key, std::string& value);
  Outcome finish() const;

 private:
  const std::string* take(const char* key);
  void wrong(const char* key, const std::string& must, const std::string& value);
  const DeviceSpec& spec_;
  std::vector<bool> taken_;
  std::vector<std::string> known_;
  std::string sentence_;
};

}  // namespace h6::device
