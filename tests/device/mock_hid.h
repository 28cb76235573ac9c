// SPDX-License-Identifier: Apache-2.0
// mock_hid.h - simulated SpaceMouse caps: umockdev gives this process and its children a /sys and a
// /dev of the test's own, so hidapi and the program run unchanged.
//
// umockdev is loaded at run time. The test builds without it and then reports that it is skipped.
#pragma once
#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/device/spacemouse_samples.h"
#include "tests/support/sanitized.h"

namespace h6::test {

// The functions used here, as umockdev.h declares them; GError stays opaque.
struct Umockdev {
  void* library = dlopen("libumockdev.so.0", RTLD_NOW);
  template <class F>
  void find(F& function, const char* name) {
    if (library) function = reinterpret_cast<F>(dlsym(library, name));
  }
  void* (*create)() = nullptr;
  int (*add)(void*, const char*, void**) = nullptr;
  int (*ioctls)(void*, const char*, const char*, void**) = nullptr;
  int (*device_end)(void*, const char*) = nullptr;
  void (*remove)(void*, const char*) = nullptr;
  Umockdev() {
    find(create, "umockdev_testbed_new");
    find(add, "umockdev_testbed_add_from_string");
    find(ioctls, "umockdev_testbed_load_ioctl");
    find(device_end, "umockdev_testbed_get_dev_fd");
    find(remove, "umockdev_testbed_remove_device");
  }
  bool usable() const { return create && add && ioctls && device_end && remove; }
};

// For main: starts this program again with umockdev preloaded. Returns 0 to go on; else the exit
// code, 77 for "skipped".
inline int enter_mock(char** argv) {
  const Umockdev u;
  void* const preload = dlopen("libumockdev-preload.so.0", RTLD_LAZY | RTLD_NOLOAD);
  if (preload && u.usable()) return 0;
  const char* why = !u.usable()  ? "umockdev is not installed"
                    : kSanitized ? "umockdev and sanitizers exclude each other"
                    : std::getenv("HAPSIX_MOCK_TRIED") ? "umockdev does not work here"
                                                       : nullptr;
  if (!why) {
    setenv("HAPSIX_MOCK_TRIED", "1", 1);
    setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
    execv("/proc/self/exe", argv);
    why = "it could not be started with umockdev";
  }
  std::printf("skipped: %s\n", why);
  return 77;
}

struct MockCap {
  std::string serial = "A1", product = "SpaceMouse Compact";
  unsigned product_id = 0xc635;
  Bytes descriptor = spacemouse_descriptor(false);
  std::string node{};  // for example "hidraw0"; and its port on the bus
  int port = 0;
};

// A simulated machine; one per process.
class MockMachine {
 public:
  MockMachine() : bed_(u_.create()) {
    std::string name = (std::filesystem::temp_directory_path() / "hapsix-mock-XXXXXX").string();
    if (mkdtemp(name.data())) folder_ = name;
    // A CAD mouse of the same maker, always there and never a cap. (Without any device umockdev
    // forgets how to add one.)
    MockCap mouse{"C3", "CadMouse", 0xc650};
    mouse.descriptor = {0x05, 0x01, 0x09, 0x02, 0xa1, 0x01, 0x85, 0x01,
                        0x75, 0x08, 0x95, 0x03, 0x81, 0x06, 0xc0};
    plug(mouse);
  }
  ~MockMachine() {
    if (!folder_.empty()) {
      std::remove((folder_ + "/ioctls").c_str());
      rmdir(folder_.c_str());
    }
  }
  // Plugs in at a new node and a new port: umockdev does not accept the same ones twice.
  bool plug(MockCap& cap) {
    cap.node = "hidraw" + std::to_string(plugged_++);
    cap.port = plugged_;
    const std::string usb = usb_path(cap), face = face_path(cap), hid = hid_path(cap);
    char numbers[200];
    std::snprintf(numbers, sizeof numbers, "E: HID_ID=0003:0000256F:0000%04X\n", cap.product_id);
    char product[80];
    std::snprintf(product, sizeof product, "A: idVendor=256f\nA: idProduct=%04x\n", cap.product_id);
    const std::string text =
        "P: " + usb + "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\n" + product +
        "A: manufacturer=3Dconnexion\nA: product=" + cap.product + "\nA: serial=" + cap.serial +
        "\nA: bcdDevice=0100\n\nP: " + face +
        "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\nA: bInterfaceNumber=00\n\nP: " + hid +
        "\nE: SUBSYSTEM=hid\n" + numbers + "E: HID_NAME=3Dconnexion " + cap.product +
        "\nE: HID_PHYS=usb-1\nE: HID_UNIQ=" + cap.serial +
        "\nH: report_descriptor=" + hex(cap.descriptor) + "\n\nP: " + raw_path(cap) +
        "\nN: " + cap.node + "\nE: SUBSYSTEM=hidraw\nE: DEVNAME=/dev/" + cap.node +
        "\nA: dev=240:" + std::to_string(cap.port) + "\nL: device=../../../" +
        hid.substr(hid.rfind('/') + 1) + "\n\n";
    if (!u_.add(bed_, text.c_str(), nullptr)) return false;
    const std::uint32_t size = static_cast<std::uint32_t>(cap.descriptor.size());
    const Bytes size_bytes{static_cast<std::uint8_t>(size), static_cast<std::uint8_t>(size >> 8), 0,
                           0};
    // struct hidraw_report_descriptor always holds 4096 bytes.
    Bytes whole = size_bytes + cap.descriptor;
    whole.resize(4 + 4096);
    std::ofstream(folder_ + "/ioctls")
        << "@DEV /dev/" << cap.node << "\nHIDIOCGRDESCSIZE 0 " << hex(size_bytes)
        << "\nHIDIOCGRDESC 0 " << hex(whole) << "\n";
    return u_.ioctls(bed_, ("/dev/" + cap.node).c_str(), (folder_ + "/ioctls").c_str(), nullptr);
  }
  void unplug(const MockCap& cap) {
    // Readers must see a hang-up; umockdev alone would keep the node open. The other end stays open
    // so that the number of its terminal is not given out again.
    (void)open(("/dev/" + cap.node).c_str(), O_RDWR | O_NOCTTY);
    close(end_of(cap));
    // Children first: they take their links on the bus with them.
    for (const std::string& path : {raw_path(cap), hid_path(cap), face_path(cap), usb_path(cap)})
      u_.remove(bed_, ("/sys" + path).c_str());
  }

  // A report from the device. The node has no message boundaries: leave some ms between two.
  bool send(const MockCap& cap, const Bytes& report) {
    const ssize_t n = write(end_of(cap), report.data(), report.size());
    return n == static_cast<ssize_t>(report.size());
  }
  // Bytes written to the device within `ms` [ms]; the device may be opened during that time.
  Bytes received(const MockCap& cap, int ms) {
    std::uint8_t bytes[64];
    for (;; ms -= 5) {
      pollfd wait{end_of(cap), POLLIN, 0};
      if (poll(&wait, 1, 0) == 1 && (wait.revents & POLLIN)) {
        const ssize_t n = read(wait.fd, bytes, sizeof bytes);
        if (n > 0) return Bytes(bytes, bytes + n);
      }
      if (ms <= 0) return {};
      usleep(5000);
    }
  }

 private:
  int end_of(const MockCap& cap) { return u_.device_end(bed_, ("/dev/" + cap.node).c_str()); }
  static std::string usb_path(const MockCap& cap) {
    return "/devices/pci0000:00/0000:00:14.0/usb1/1-" + std::to_string(cap.port);
  }
  static std::string face_path(const MockCap& cap) {
    return usb_path(cap) + "/1-" + std::to_string(cap.port) + ":1.0";
  }
  static std::string hid_path(const MockCap& cap) {
    char id[64];
    std::snprintf(id, sizeof id, "/0003:256F:%04X.%04d", cap.product_id, cap.port);
    return face_path(cap) + id;
  }
  static std::string raw_path(const MockCap& cap) { return hid_path(cap) + "/hidraw/" + cap.node; }
  static std::string hex(const Bytes& bytes) {
    std::string text;
    char two[3];
    for (const std::uint8_t b : bytes) {
      std::snprintf(two, sizeof two, "%02X", b);
      text += two;
    }
    return text;
  }
  Umockdev u_;
  void* bed_;
  std::string folder_;
  int plugged_ = 0;
};

}  // namespace h6::test
