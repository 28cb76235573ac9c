// SPDX-License-Identifier: Apache-2.0
// vendor_test.cpp - the plug-ins for Force Dimension, 3D Systems and Haption, each against a
// stand-in for the vendor's library (tests/device/standins). No vendor's library and no device was
// ever here.
#include <dlfcn.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "device/plugin.h"
#include "tests/device/floor.h"
#include "tests/device/standins/standin.h"

using namespace h6;
using h6::device::PluginDevice;
using h6::standin::Fault;
using h6::standin::Standin;
using h6::test::Floor;
using h6::test::FloorRun;

namespace {

struct Vendor {
  std::string name;
  std::string title;          // of the opened device
  int of[3];                  // the device's axis that is the world's x, y, z
  double rating;              // without options [N]
  double torques;             // of the vendor's unit in N m
  double place, angle;        // what numbers of its type can tell
  const char* error;          // its word for a lost cable
  device::PluginFile file{};  // with a longer patience: this machine may be busy
  Standin* standin = nullptr;
};

std::string in_folder(const std::string& name) { return HAPSIX_PLUGIN_FOLDER "/" + name + ".so"; }

// The vendors, with their stand-ins as new.
std::vector<Vendor> vendors() {
  std::vector<Vendor> all = {
      {"dhd",
       "Force Dimension omega.stand-in, no watchdog",
       {0, 1, 2},
       5,
       1,
       1e-12,
       1e-12,
       "communication error"},
      {"hdapi", "3D Systems stand-in", {2, 0, 1}, 1.5, 1e-3, 1e-12, 1e-12, "comm error"},
      {"haption",
       "Haption Virtuose at 127.0.0.1#53210",
       {0, 1, 2},
       3,
       1,
       1e-7,
       1e-6,
       "communication failure"}};
  for (Vendor& v : all) {
    const std::string library = in_folder(v.name + "_standin");
    v.file = {in_folder(v.name), {{"library", library}, {"timeout", "500"}}};
    if (v.name == "dhd") v.file.options.push_back({"watchdog", "0"});
    void* loaded = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);  // to stay
    REQUIRE_MESSAGE(loaded, library);
    v.standin = static_cast<Standin*>(dlsym(loaded, "standin"));
    REQUIRE(v.standin);
    REQUIRE(!v.standin->open);
    v.standin->reset();
  }
  return all;
}

std::unique_ptr<PluginDevice> opened(const Vendor& v,
                                     const h6Pose& home = {{0, 0, 0}, {1, 0, 0, 0}}) {
  auto result = PluginDevice::open(v.file, home, {});
  REQUIRE_MESSAGE(result, v.name, ": ", (result ? "" : result.error()));
  return std::move(*result);
}
std::string sentence(const device::PluginFile& file, double patience = 10) {
  auto result = PluginDevice::open(file, {{0, 0, 0}, {1, 0, 0, 0}}, {}, patience);
  CHECK(!result);
  return result ? "" : result.error();
}
bool says(const std::string& text, const std::string& part) {
  const bool found = text.find(part) != std::string::npos;
  CHECK_MESSAGE(found, "'", text, "' lacks '", part, "'");
  return found;
}

// A haptic thread of no engine: it reads and writes a wrench, a frame a millisecond.
struct Hand {
  PluginDevice& device;
  h6DeviceSample sample{};
  int lost = 0;
  void hold(const h6Wrench& wrench, double seconds) {
    h6DeviceCommand c{};
    c.wrench = wrench;
    for (const double end = standin::now() + seconds; standin::now() < end;) {
      if (device.read(0, sample) != 0) ++lost;
      CHECK(device.write(0, c) == 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  // Until it is so, at most 5 s.
  template <class Condition>
  bool hold_until(const h6Wrench& wrench, Condition condition) {
    for (int i = 0; i < 500 && !condition(); ++i) hold(wrench, 0.01);
    return condition();
  }
  bool there() { return device.read(0, sample) == 0; }
};

double norm_of(const std::atomic<double> v[3]) { return std::hypot(v[0], v[1], v[2]); }

}  // namespace

TEST_CASE("a vendor's device is opened at home, without power, and its handle moves the part") {
  for (const Vendor& v : vendors()) {
    CAPTURE(v.name);
    const h6Pose home{{0.1, 0.2, 0.3}, {0.6, 0, 0.8, 0}};
    const auto device = opened(v, home);
    const h6DeviceCapabilities can = device->device().capabilities;
    CHECK(std::string(can.name) == v.title);
    CHECK(can.dof_in == 6);
    CHECK(can.dof_out == 6);
    CHECK(can.max_force == v.rating);
    CHECK(!v.standin->power);
    Hand hand{*device};
    REQUIRE(hand.there());
    CHECK(std::fabs(hand.sample.pose.p.z - 0.3) < v.place);
    CHECK(std::fabs(hand.sample.pose.q.y - 0.8) < v.angle);
    v.standin->buttons = 2;
    // World x, y, z; and a turn about the device's x.
    const double moved[3] = {0.01, -0.02, 0.03};
    for (int i = 0; i < 3; ++i) v.standin->hand[v.of[i]] = moved[i];
    v.standin->turn = 0.3 + 0.5;
    hand.hold({}, 0.5);
    CHECK(std::fabs(hand.sample.pose.p.x - 0.11) < 1e-6);
    CHECK(std::fabs(hand.sample.pose.p.y - 0.18) < 1e-6);
    CHECK(std::fabs(hand.sample.pose.p.z - 0.33) < 1e-6);
    // The turn is about the world's x, or y where that is the device's x. It comes before the
    // home's.
    const double c = std::cos(0.25), s = std::sin(0.25);
    const h6Quat q = hand.sample.pose.q;
    if (v.of[0] == 0) {
      CHECK(std::fabs(q.w - 0.6 * c) < 1e-6);
      CHECK(std::fabs(q.x - 0.6 * s) < 1e-6);
      CHECK(std::fabs(q.z - 0.8 * s) < 1e-6);
    } else {
      CHECK(std::fabs(q.w - (0.6 * c - 0.8 * s)) < 1e-6);
      CHECK(std::fabs(q.y - (0.8 * c + 0.6 * s)) < 1e-6);
    }
    CHECK((hand.sample.buttons & 0xf) == 2);
    CHECK(std::fabs(hand.sample.velocity.linear.x) < 1e-3);
    CHECK(v.standin->misused == 0);
  }
}

TEST_CASE("a wrench arrives in the vendor's unit, axes and sign, not before the device is armed") {
  for (const Vendor& v : vendors()) {
    CAPTURE(v.name);
    const auto device = opened(v);
    Hand hand{*device};
    const h6Wrench wrench{{0.4, 0.8, -0.7}, {0.01, 0.02, -0.03}};
    hand.hold(wrench, 0.1);
    CHECK(norm_of(v.standin->force) == 0);
    CHECK(!v.standin->power);
    REQUIRE(device->arm() == 0);
    REQUIRE(hand.hold_until(wrench, [&] { return norm_of(v.standin->force) > 1.13; }));
    hand.hold(wrench, 0.3);  // a soft start of the plug-in is over
    const double force[3] = {0.4, 0.8, -0.7}, torque[3] = {0.01, 0.02, -0.03};
    for (int i = 0; i < 3; ++i) {
      CHECK(std::fabs(v.standin->force[v.of[i]] - force[i]) < 1e-6);
      CHECK(std::fabs(v.standin->torque[v.of[i]] * v.torques - torque[i]) < 1e-6);
    }
    // The hand yields to the force: -0.7 N on 2000 N/m.
    CHECK(std::fabs(hand.sample.pose.p.z + 0.35e-3) < 1e-6);
    CHECK(v.standin->powered == 1);

    // More than the rating is cut to it, what is no number is zero.
    hand.hold({{0, 0, 100}, {0, 50, 0}}, 0.1);
    CHECK(std::fabs(norm_of(v.standin->force) - v.rating) < 1e-6);
    CHECK(norm_of(v.standin->torque) * v.torques < 0.2 + 1e-6);
    hand.hold({{std::nan(""), 0, 1}, {0, 0, 0}}, 0.1);
    CHECK(norm_of(v.standin->force) == 0);

    // stop ends it, whatever is written; so does a silent host; arm leads back.
    hand.hold(wrench, 0.1);
    device->device().stop(device->device().self);
    hand.hold(wrench, 0.1);
    CHECK(norm_of(v.standin->force) == 0);
    REQUIRE(device->arm() == 0);
    REQUIRE(hand.hold_until(wrench, [&] { return norm_of(v.standin->force) > 1; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    CHECK(norm_of(v.standin->force) == 0);
    CHECK(hand.there());
    CHECK(v.standin->misused == 0);
  }
}

TEST_CASE("closing ends with zero force and without power") {
  for (const Vendor& v : vendors()) {
    CAPTURE(v.name);
    auto device = opened(v);
    Hand hand{*device};
    const h6Wrench wrench{{0, 0, 1}, {0, 0, 0}};
    REQUIRE(hand.there());
    REQUIRE(device->arm() == 0);
    REQUIRE(hand.hold_until(wrench, [&] { return norm_of(v.standin->force) > 0.5; }));
    device.reset();
    CHECK(norm_of(v.standin->force) == 0);
    CHECK(!v.standin->power);
    CHECK(!v.standin->open);
  }
}

TEST_CASE("pressed on a floor, it gives up to its rating, or to a lower one of the options") {
  for (Vendor& v : vendors()) {
    CAPTURE(v.name);
    Floor floor;
    v.file.options.push_back({"max_force", "1"});
    const auto device = opened(v, floor.body[1].pose);
    CHECK(device->device().capabilities.max_force == 1);
    FloorRun run(floor, device->device());
    v.standin->hand[v.of[2]] = -0.02;
    REQUIRE(run.until([](const h6FrameRecord& r) { return test::force(r) > 0.9; }));
    for (int i = 0; i < 400 && !(v.standin->force[v.of[2]] > 0.9); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    CHECK(v.standin->force[v.of[2]] > 0.9);
    CHECK(v.standin->most <= 1 + 1e-6);
  }
}

TEST_CASE("every fault of a vendor's device in the loop: zero force, lost, armed only by hand") {
  for (const Vendor& v : vendors()) {
    Floor floor;
    const auto device = opened(v, floor.body[1].pose);
    FloorRun run(floor, device->device());
    v.standin->hand[v.of[2]] = -0.02;
    for (const Fault fault : {Fault::error, Fault::write, Fault::not_finite, Fault::garbage,
                              Fault::stall, Fault::unplugged}) {
      if (fault == Fault::unplugged && v.name == "hdapi") continue;  // it does not open anew
      CAPTURE(v.name);
      CAPTURE(static_cast<int>(fault));
      run.check_loss([&] { v.standin->fault = fault; },
                     [&] {
                       // A device that does not answer cannot tell what it feels.
                       const bool answers = fault != Fault::stall && fault != Fault::unplugged;
                       if (answers) CHECK(!v.standin->power);
                       if (answers && fault != Fault::write) CHECK(norm_of(v.standin->force) == 0);
                       v.standin->most = 0;
                       // `unplugged` ends when it is opened anew.
                       if (fault != Fault::unplugged) v.standin->fault = Fault::none;
                     });
    }
    CHECK(v.standin->powered >= 3);
  }
}

TEST_CASE("the plug-in by itself keeps zero force after a fault, until it is armed") {
  const h6Wrench wrench{{0, 0, 1}, {0, 0, 0}};
  for (const Vendor& v : vendors()) {
    const auto device = opened(v);
    Hand hand{*device};
    REQUIRE(hand.there());
    for (const Fault fault : {Fault::error, Fault::write, Fault::not_finite, Fault::garbage,
                              Fault::stall, Fault::unplugged, Fault::special}) {
      const bool returns = fault != Fault::unplugged || v.name != "hdapi";  // it does not open anew
      const bool known = fault != Fault::special || v.name == "haption";
      if (!returns || !known) continue;
      CAPTURE(v.name);
      CAPTURE(static_cast<int>(fault));
      REQUIRE(hand.hold_until(wrench, [&] { return hand.there(); }));
      REQUIRE(device->arm() == 0);
      REQUIRE(hand.hold_until(wrench, [&] { return norm_of(v.standin->force) > 0.9; }));
      hand.lost = 0;
      v.standin->fault = fault;
      REQUIRE(hand.hold_until(wrench, [&] { return hand.lost > 0; }));
      if (fault != Fault::unplugged) CHECK(device->arm() != 0);
      hand.hold(wrench, 0.05);
      v.standin->most = 0;
      if (fault != Fault::unplugged) v.standin->fault = Fault::none;  // that ends when it is opened
      REQUIRE(hand.hold_until(wrench, [&] { return hand.there(); }));
      hand.hold(wrench, 0.2);
      CHECK(v.standin->most == 0);
      CHECK(norm_of(v.standin->force) == 0);
    }
    CHECK(v.standin->misused == 0);
  }
}

TEST_CASE("a fault that is over before the host looks is reported once, and disarms") {
  const h6Wrench wrench{{0, 0, 1}, {0, 0, 0}};
  for (const Vendor& v : vendors()) {
    CAPTURE(v.name);
    const auto device = opened(v);
    Hand hand{*device};
    REQUIRE(hand.there());
    REQUIRE(device->arm() == 0);
    REQUIRE(hand.hold_until(wrench, [&] { return norm_of(v.standin->force) > 0.9; }));
    v.standin->fault = Fault::error;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    v.standin->fault = Fault::none;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    CHECK(!hand.there());
    CHECK(hand.there());
    v.standin->most = 0;
    hand.hold(wrench, 0.2);
    CHECK(v.standin->most == 0);
  }
}

TEST_CASE("the environment's fault comes after its time: the device is lost, at zero force") {
  for (const Vendor& v : vendors()) {
    CAPTURE(v.name);
    setenv("HAPSIX_STANDIN", "error 400", 1);
    const auto device = opened(v);
    unsetenv("HAPSIX_STANDIN");
    Hand hand{*device};
    REQUIRE(hand.there());
    REQUIRE(device->arm() == 0);
    REQUIRE(hand.hold_until({{0, 0, 1}, {0, 0, 0}}, [&] { return hand.lost > 0; }));
    hand.hold({{0, 0, 1}, {0, 0, 0}}, 0.1);
    CHECK(!hand.there());
    CHECK(norm_of(v.standin->force) == 0);
    CHECK(!v.standin->power);
  }
}

TEST_CASE("what does not open says so in one sentence: device, library, call, state") {
  for (const Vendor& v : vendors()) {
    CAPTURE(v.name);
    const auto with_fault = [&](Fault fault, double patience = 10) {
      v.standin->fault = fault;
      const std::string text = sentence(v.file, patience);
      v.standin->fault = Fault::none;
      return text;
    };
    setenv("HAPSIX_STANDIN", "open", 1);
    const std::string refused = sentence(v.file);
    says(refused, v.name == "haption" ? "no Virtuose answers at 127.0.0.1#53210" : "connect it, ");
    unsetenv("HAPSIX_STANDIN");
    v.standin->reset();
    CHECK(v.standin->opened == 0);
    says(with_fault(Fault::error), "gives no place: " + std::string(v.error));
    says(with_fault(Fault::not_finite), "gives no place: its place is no place");
    says(with_fault(Fault::stall, 1), "did not end within 1 s");

    device::PluginFile wrong = v.file;
    wrong.options[0].second = "/nowhere/vendor.so";
    const std::string missing = sentence(wrong);
    says(missing, "cannot load /nowhere/vendor.so of ");
    says(missing, "give library=PATH");
    wrong.options[0].second = in_folder(v.name == "dhd" ? "hdapi_standin" : "dhd_standin");
    const std::string other = sentence(wrong);
    says(other, " has no call ");
    says(other, "too old");
  }
}

TEST_CASE("a wrong option is refused with its name and what it may be") {
  for (const Vendor& v : vendors()) {
    CAPTURE(v.name);
    const auto with = [&](const char* key, const char* value) {
      device::PluginFile file = v.file;
      file.options.push_back({key, value});
      return sentence(file);
    };
    says(with("colour", "red"), "the options are library, axes, timeout");
    says(with("timeout", "5000"), "timeout must be 5 to 1000 ms");
    says(with("max_force", "1000"), "max_force must be above 0 and at most");
    says(with("max_force", "nan"), "max_force must be above 0 and at most");
    says(with("max_torque", "-1"), "max_torque must be above 0 and at most");
    for (const char* axes : {"xy", "xyy", "xzy", "-xyz", "x-yzz", "xyz-", "--xyz"})
      says(with("axes", axes), "axes must be a right-handed order");
  }
}

TEST_CASE("the option axes turns places and forces alike") {
  for (Vendor& v : vendors()) {
    CAPTURE(v.name);
    v.file.options.push_back({"axes", "-yxz"});
    const auto device = opened(v);
    Hand hand{*device};
    REQUIRE(hand.there());
    v.standin->hand[1] = 0.02;
    hand.hold({}, 0.4);
    CHECK(std::fabs(hand.sample.pose.p.x + 0.02) < 1e-6);
    CHECK(std::fabs(hand.sample.pose.p.y) < 1e-6);
    REQUIRE(device->arm() == 0);
    const h6Wrench wrench{{1, 0, 0}, {0, 0, 0}};
    REQUIRE(hand.hold_until(wrench, [&] { return norm_of(v.standin->force) > 0.99; }));
    CHECK(v.standin->force[1] < -0.99);
    CHECK(std::fabs(v.standin->force[0]) < 1e-6);
  }
}

TEST_CASE("a device that turns without torques, or does neither, says so and gets no torque") {
  for (const Vendor& v : vendors()) {
    if (v.name == "haption") continue;  // it always does both
    CAPTURE(v.name);
    v.standin->torques = false;
    {
      const auto device = opened(v);
      CHECK(device->device().capabilities.dof_in == 6);
      CHECK(device->device().capabilities.dof_out == 3);
      CHECK(device->device().capabilities.max_torque == 0);
      Hand hand{*device};
      REQUIRE(hand.there());
      REQUIRE(device->arm() == 0);
      const h6Wrench wrench{{0, 0, 1}, {0.1, 0, 0}};
      REQUIRE(hand.hold_until(wrench, [&] { return norm_of(v.standin->force) > 0.9; }));
      CHECK(norm_of(v.standin->torque) == 0);
    }
    v.standin->turns = false;
    CHECK(opened(v)->device().capabilities.dof_in == 3);
  }
}

TEST_CASE(
    "Force Dimension: the firmware gets its watchdog, and a serial number chooses the device") {
  Vendor v = vendors()[0];
  v.file.options.pop_back();
  v.file.options.push_back({"serial", "7"});
  {
    const auto device = opened(v);
    CHECK(std::string(device->device().capabilities.name) == "Force Dimension omega.stand-in");
    CHECK(std::fabs(v.standin->watchdog - 0.02) < 1e-9);
    // Another device in its place is not taken for it.
    Hand hand{*device};
    v.standin->serial = 8;
    v.standin->fault = Fault::unplugged;
    hand.hold({}, 2.5);
    CHECK(v.standin->opened > 1);
    CHECK(!hand.there());
    v.standin->serial = 7;
    CHECK(hand.hold_until({}, [&] { return hand.there(); }));
  }
  v.file.options.back().second = "8";
  says(sentence(v.file), "opens with serial 8");
  v.file.options.back() = {"watchdog", "32"};
  says(sentence(v.file), "watchdog must be 0 (none) to 31 ms");
}

TEST_CASE("3D Systems: a stylus that is not calibrated and a second device are refused") {
  const Vendor v = vendors()[1];
  v.standin->fault = Fault::special;
  says(sentence(v.file), "not calibrated");
  v.standin->fault = Fault::none;
  device::PluginFile named = v.file;
  named.options.push_back({"device", "Middle"});
  says(sentence(named), "HDAPI does not open Middle");
  named.options.back().second = "Left";
  auto first = PluginDevice::open(named, {{0, 0, 0}, {1, 0, 0, 0}}, {});
  REQUIRE_MESSAGE(first, (first ? "" : first.error()));
  says(sentence(v.file), "one at a time");
}

TEST_CASE("Haption: shifted or let go it has no force, then it rises softly; its stop is a loss") {
  const Vendor v = vendors()[2];
  const auto device = opened(v);
  Hand hand{*device};
  REQUIRE(hand.there());
  REQUIRE(device->arm() == 0);
  const h6Wrench wrench{{0, 0, 1}, {0, 0, 0}};
  REQUIRE(hand.hold_until(wrench, [&] { return v.standin->force[2] > 0.99; }));
  for (std::atomic<bool>* state : {&v.standin->shifted, &v.standin->held}) {
    *state = !*state;
    REQUIRE(hand.hold_until(wrench, [&] { return v.standin->force[2] == 0; }));
    CHECK(hand.there());
    *state = !*state;
    hand.hold(wrench, 0.02);
    CHECK(v.standin->force[2] < 0.9);
    REQUIRE(hand.hold_until(wrench, [&] { return v.standin->force[2] > 0.99; }));
  }
  CHECK((hand.sample.buttons & 1u << 4) != 0);
  const int before = v.standin->opened;
  v.standin->fault = Fault::special;
  REQUIRE(hand.hold_until(wrench, [&] { return hand.lost > 0; }));
  hand.hold(wrench, 1.5);
  CHECK(norm_of(v.standin->force) == 0);
  CHECK(!v.standin->power);
  CHECK(v.standin->opened == before);  // the connection was good: it is not opened anew
}
