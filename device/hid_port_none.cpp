// SPDX-License-Identifier: Apache-2.0
// hid_port_none.cpp - for builds without hidapi: there are no HID devices.
#include "device/hid_port.h"

namespace h6::device {
namespace {

class Port final : public HidPort {
 public:
  std::vector<HidInterface> list() override { return {}; }
  Result<std::unique_ptr<HidHandle>> open(const std::string& path) override {
    return Failure{
        path + ": this program was built without hidapi, install libhidapi-dev and build again"};
  }
};

}  // namespace

HidPort& system_hid() {
  static Port port;
  return port;
}

bool built_with_hidapi() { return false; }

}  // namespace h6::device
