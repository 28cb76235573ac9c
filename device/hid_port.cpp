// SPDX-License-Identifier: Apache-2.0
// hid_port.cpp - HID through hidapi; no other file includes hidapi.
#include "device/hid_port.h"

#include <hidapi.h>

#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <mutex>

namespace h6::device {
namespace {

// hidapi keeps the text of its last error in one place for all threads.
std::mutex& hidapi_lock() {
  static std::mutex lock;
  return lock;
}

std::string narrow(const wchar_t* text) {
  std::string out;
  for (; text && *text; ++text) out += *text < 0x80 ? static_cast<char>(*text) : '?';
  return out;
}

// hidapi 0.13 has no call for the descriptor. Any user may read this file.
std::vector<std::uint8_t> descriptor_of(const std::string& path) {
  const std::string node = path.substr(path.rfind('/') + 1);
  std::ifstream in("/sys/class/hidraw/" + node + "/device/report_descriptor", std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in),
                                  std::istreambuf_iterator<char>()};
  if (bytes.size() > 4096) bytes.clear();
  return bytes;
}

class Handle final : public HidHandle {
 public:
  explicit Handle(hid_device* device) : device_(device) {}
  ~Handle() override { hid_close(device_); }
  int read(std::span<std::uint8_t> report, int timeout_ms) override {
    return hid_read_timeout(device_, report.data(), report.size(), timeout_ms);
  }
  bool write(std::span<const std::uint8_t> report) override {
    return hid_write(device_, report.data(), report.size()) >= 0;
  }

 private:
  hid_device* device_;
};

class Port final : public HidPort {
 public:
  std::vector<HidInterface> list() override {
    std::vector<HidInterface> found;
    const std::lock_guard<std::mutex> guard(hidapi_lock());
    hid_device_info* const all = hid_enumerate(0, 0);
    for (const hid_device_info* d = all; d; d = d->next) {
      if (!d->path) continue;
      found.push_back({d->path,
                       narrow(d->serial_number),
                       narrow(d->product_string),
                       d->vendor_id,
                       d->product_id,
                       d->usage_page,
                       d->usage,
                       {}});
      found.back().descriptor = descriptor_of(d->path);
    }
    hid_free_enumeration(all);
    return found;
  }

  Result<std::unique_ptr<HidHandle>> open(const std::string& path) override {
    const std::lock_guard<std::mutex> guard(hidapi_lock());
    if (hid_device* device = hid_open_path(path.c_str()))
      return std::unique_ptr<HidHandle>(new Handle(device));
    errno = 0;
    const int refused = access(path.c_str(), R_OK | W_OK) == 0 ? 0 : errno;
    if (refused == EACCES || refused == EPERM)
      return Failure{path +
                     ": you may not open this device; 'hapsix devices --udev-rules | sudo tee "
                     "/etc/udev/rules.d/70-hapsix.rules' lets everyone who sits at this machine, "
                     "then unplug it and plug it in again"};
    return Failure{path + ": cannot be opened" +
                   (refused ? std::string(" (") + std::strerror(refused) + ")" : "") +
                   ", unplug it and plug it in again"};
  }
};

}  // namespace

HidPort& system_hid() {
  static Port port;
  return port;
}

bool built_with_hidapi() { return true; }

}  // namespace h6::device
