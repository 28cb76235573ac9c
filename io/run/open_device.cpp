// SPDX-License-Identifier: Apache-2.0
// open_device.cpp - opens every device that the program knows, by name.
#include "io/run/open_device.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

#include "device/bad_operator.h"
#include "device/device_spec.h"
#include "device/path_device.h"
#include "device/plugin.h"
#include "device/recorded_hand.h"
#include "device/scripted_hand.h"
#include "device/simulated_arm.h"
#include "device/simulated_hand.h"
#include "device/spacemouse.h"
#include "io/console/checks.h"
#include "io/record/recording.h"

namespace h6::cli {
namespace {

using device::DeviceSpec;
using device::OptionReader;

template <class Device>
Result<OpenedDevice> keep(Result<std::unique_ptr<Device>> made) {
  if (!made) return made.failure();
  OpenedDevice out;
  std::shared_ptr<Device> alive = std::move(*made);
  out.device = alive->device();
  out.alive = std::move(alive);
  return out;
}

// Puts `device` in front of another device and keeps both alive.
template <class Device>
OpenedDevice in_front(OpenedDevice behind, Device device) {
  struct Both {
    OpenedDevice behind;
    Device device;
  };
  auto both = std::make_shared<Both>(Both{std::move(behind), std::move(device)});
  OpenedDevice out;
  out.device = both->device.device();
  out.alive = std::move(both);
  return out;
}

// Opens the path itself or a simulated person who follows it.
Result<OpenedDevice> hand_by_name(const std::string& name, device::HandPath path,
                                  const h6Vec3& grip) {
  if (name == "path") return keep(device::PathDevice::open(std::move(path)));
  device::Arm person;
  person.grip = grip;
  return keep(device::SimulatedHand::open(std::move(path), person));
}

// ---- a SpaceMouse ------------------------------------------------------------------------------

Outcome read_spacemouse(const DeviceSpec& spec, device::SpaceMouseOptions& o) {
  OptionReader read(spec);
  read.text("serial", o.serial);
  read.number("speed", 0, 10, o.rate.speed);
  read.number("turn", 0, 100, o.rate.turn_speed);
  read.number("dead-zone", 0, 0.9, o.rate.dead_zone);
  read.number("curve", 1, 5, o.rate.curve);
  static constexpr const char* axes[] = {"x", "y", "z", "rx", "ry", "rz"};
  for (std::size_t i = 0; i < 6; ++i) read.number(axes[i], -10, 10, o.rate.scale[i]);
  read.yes_no("dominant", o.rate.dominant);
  std::string up = "z";
  read.one_of("up", {"y", "z"}, up);
  o.rate.y_up = up == "y";
  read.number("smoothing", 0, 1, o.rate.smoothing);
  unsigned long long clutch = o.rate.clutch_buttons, reset = o.rate.reset_buttons;
  read.whole("clutch", 0xffffffffu, clutch);
  read.whole("reset", 0xffffffffu, reset);
  o.rate.clutch_buttons = static_cast<std::uint32_t>(clutch);
  o.rate.reset_buttons = static_cast<std::uint32_t>(reset);
  o.rate.yield_force = 5, o.rate.yield_torque = 0.5;
  read.number("yield", 0, 1e6, o.rate.yield_force);
  read.number("yield-torque", 0, 1e6, o.rate.yield_torque);
  read.number("led-force", 1e-3, 1e3, o.led_force);
  return read.finish();
}

std::string bars(const device::SpaceMouse::Status& s) {
  static constexpr const char* axes[] = {"x", "y", "z", "rx", "ry", "rz"};
  std::string out;
  char text[40];
  for (std::size_t i = 0; i < 6; ++i) {
    std::snprintf(text, sizeof text, "%s%+4d ", axes[i], s.state.axis[i]);
    out += text;
  }
  if (s.state.battery >= 0) {
    std::snprintf(text, sizeof text, "battery %d %%%s ", s.state.battery,
                  s.state.charging ? ", charging" : "");
    out += text;
  }
  std::snprintf(text, sizeof text, "felt %.2f N ", s.felt_force);
  out += text;
  return out + (s.led ? "light on" : "light off") + (s.present ? "" : ", unplugged");
}

Result<OpenedDevice> open_spacemouse(const DeviceSpec& spec, const DevicePlace& place) {
  device::SpaceMouseOptions options;
  if (Outcome good = read_spacemouse(spec, options); !good) return good.failure();
  auto made = device::SpaceMouse::open(device::system_hid(), options, place.home, place.grip);
  if (!made) return made.failure();
  std::shared_ptr<device::SpaceMouse> mouse = std::move(*made);
  OpenedDevice out;
  out.device = mouse->device();
  out.live = [mouse] { return bars(mouse->status()); };
  out.alive = std::move(mouse);
  return out;
}

// ---- a plug-in ---------------------------------------------------------------------------------

Result<OpenedDevice> open_plugin(const DeviceSpec& spec, const DevicePlace& place) {
  auto made = device::PluginDevice::open({spec.target, spec.options}, place.home, place.grip);
  if (!made) return made.failure();
  std::string about = (*made)->about();
  Result<OpenedDevice> out = keep(std::move(made));
  out->about = std::move(about);
  return out;
}

// ---- hands without hardware --------------------------------------------------------------------

struct BadOptions {
  device::BadOperatorFigures figures;
  std::string hand = "simulated";
};

Outcome read_bad_operator(const DeviceSpec& spec, BadOptions& o) {
  OptionReader read(spec);
  unsigned long long seed = o.figures.seed;
  read.whole("seed", 1000000000000ull, seed);
  o.figures.seed = seed;
  read.number("every", 1e-3, 1000, o.figures.every);
  read.number("shake", 0, 1, o.figures.shake);
  read.number("jerk", 0, 1, o.figures.jerk);
  read.number("jump", 0, 10, o.figures.jump);
  read.one_of("hand", {"simulated", "path"}, o.hand);
  std::string kinds;
  read.text("kinds", kinds);
  if (Outcome good = read.finish(); !good || kinds.empty()) return good;
  o.figures.kinds = 0;
  for (std::size_t at = 0; at <= kinds.size();) {
    const std::size_t end = std::min(kinds.find(',', at), kinds.size());
    const std::string kind = kinds.substr(at, end - at);
    std::size_t i = 0;
    while (i < device::kTroubles && kind != device::trouble_name(static_cast<device::Trouble>(i)))
      ++i;
    if (i == device::kTroubles)
      return Failure{
          "the option 'kinds' of bad-operator must be some of shake,jerk,freeze,nan,jump,"
          "unplug, not '" +
          kind + "'"};
    o.figures.kinds |= 1u << i;
    at = end + 1;
  }
  return Done{};
}

Result<OpenedDevice> open_bad_operator(const DeviceSpec& spec, const DevicePlace& place) {
  BadOptions options;
  if (Outcome good = read_bad_operator(spec, options); !good) return good.failure();
  Result<OpenedDevice> hand = hand_by_name(options.hand, place.path, place.grip);
  if (!hand) return hand;
  Result<device::BadOperator> bad = device::BadOperator::open(hand->device, options.figures);
  if (!bad) return bad.failure();
  return in_front(std::move(*hand), std::move(*bad));
}

Result<OpenedDevice> open_scripted(const DeviceSpec& spec, const DevicePlace& place) {
  std::string name = "simulated";
  OptionReader read(spec);
  read.one_of("hand", {"simulated", "path"}, name);
  if (Outcome good = read.finish(); !good) return good.failure();
  if (Outcome there = check_input(spec.target); !there) return there.failure();
  std::error_code ignored;
  if (std::filesystem::file_size(spec.target, ignored) > (1u << 20))
    return Failure{spec.target + ": too long for a hand script, which has a megabyte at most"};
  std::ifstream in(spec.target, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  auto script = device::read_hand_script(text, place.unit, place.home, place.grip);
  if (!script) return Failure{spec.target + ": " + script.error()};
  Result<OpenedDevice> hand = hand_by_name(name, std::move(script->path), place.grip);
  if (!hand) return hand;
  device::ScriptedHand scripted(hand->device, std::move(script->buttons));
  return in_front(std::move(*hand), std::move(scripted));
}

Result<OpenedDevice> open_replay(const DeviceSpec& spec) {
  unsigned long long hand = 0;
  OptionReader read(spec);
  read.whole("hand", H6_MAX_HANDS - 1, hand);
  if (Outcome good = read.finish(); !good) return good.failure();
  if (Outcome there = check_recording(spec.target); !there) return there.failure();
  std::vector<h6DeviceSample> samples;
  for (io::FrameRange range{0, 5000};; range.first += range.count) {
    Result<io::Recording> piece = io::read_recording(spec.target, range);
    if (!piece) return piece.failure();
    if (hand >= piece->head.hands)
      return Failure{spec.target + ": has " + std::to_string(piece->head.hands) +
                     " hands, and hands are counted from 0"};
    for (const h6FrameRecord& row : piece->frames) samples.push_back(row.hand[hand]);
    if (piece->frames.size() < range.count)
      return keep(device::RecordedHand::open(std::move(samples), piece->head.rate));
  }
}

Outcome check_options(const DeviceSpec& spec) {
  if (spec.name == "spacemouse") {
    device::SpaceMouseOptions ignored;
    return read_spacemouse(spec, ignored);
  }
  if (spec.name == "bad-operator") {
    BadOptions ignored;
    return read_bad_operator(spec, ignored);
  }
  const bool open_later = spec.name == "plugin" || spec.name == "scripted" || spec.name == "replay";
  return open_later ? Outcome(Done{}) : OptionReader(spec).finish();
}

const DeviceKind* find_kind(const std::string& name) {
  const auto& kinds = device_kinds();
  const auto at = std::find_if(kinds.begin(), kinds.end(),
                               [&](const DeviceKind& kind) { return name == kind.name; });
  return at == kinds.end() ? nullptr : &*at;
}

}  // namespace

const std::vector<DeviceKind>& device_kinds() {
  static const std::vector<DeviceKind> kinds{
      {"path", "path", "follows the scene's path exactly, whatever is felt", "", false},
      {"simulated", "simulated", "a person who follows it and yields to what is felt", "", false},
      {"arm", "arm", "a simulated force-feedback arm that such a person holds", "", false},
      {"spacemouse", "spacemouse[?KEY=VALUE&...]",
       "a 3Dconnexion cap: its deflection is the hand's velocity, its light shows the force",
       "serial; speed [m/s], turn [rad/s] at full deflection; dead-zone, curve, x y z rx ry rz "
       "(scales), dominant=yes|no, up=y|z, smoothing [s]; clutch, reset (bits of buttons); yield "
       "[N], yield-torque [N m] at which a push comes to a stop; led-force [N]",
       true},
      {"plugin", "plugin:FILE[?KEY=VALUE&...]",
       "a device out of a shared library (device_plugin.h)", "those of the plug-in", true},
      {"scripted", "scripted:FILE[?hand=...]",
       "does what a text says: move, turn, home, hold, press, release",
       "hand=simulated|path: who follows it", false},
      {"replay", "replay:REC.h5[?hand=N]", "the samples of a recorded hand, to the bit",
       "hand: which, from 0", false},
      {"bad-operator", "bad-operator[?KEY=VALUE&...]",
       "the scene's hand, and what goes wrong with hands",
       "seed; kinds=shake,jerk,freeze,nan,jump,unplug; every [s]; shake, jerk, jump [m]; "
       "hand=simulated|path",
       false}};
  return kinds;
}

Outcome check_device(const std::string& text) {
  Result<DeviceSpec> spec = device::parse_device_spec(text);
  if (!spec) return spec.failure();
  const DeviceKind* kind = find_kind(spec->name);
  if (!kind)
    return Failure{
        "no device is called '" + spec->name +
        "': 'path' follows the scene's path exactly, 'simulated' is a person who yields, "
        "'arm' is a simulated force-feedback arm that a person holds; 'hapsix devices' "
        "shows all"};
  const bool wants_file = std::string(kind->form).find(':') != std::string::npos;
  if (wants_file && spec->target.empty())
    return Failure{"the device '" + spec->name + "' needs a file: " + kind->form};
  if (!wants_file && !spec->target.empty())
    return Failure{"the device '" + spec->name + "' takes nothing behind a colon: " + kind->form};
  return check_options(*spec);
}

Outcome check_device_file(const std::string& text) {
  const Result<DeviceSpec> spec = device::parse_device_spec(text);
  std::error_code error;
  if (!spec || spec->name != "plugin") return Done{};
  if (!std::filesystem::is_regular_file(spec->target, error))
    return Failure{"the plug-in " + spec->target + ": there is no such file"};
  return device::PluginDevice::loads(spec->target);
}

Result<OpenedDevice> open_device(const std::string& text, const DevicePlace& place) {
  if (Outcome known = check_device(text); !known) return known.failure();
  const DeviceSpec spec = *device::parse_device_spec(text);
  Result<OpenedDevice> out = Failure{""};
  if (spec.name == "spacemouse")
    out = open_spacemouse(spec, place);
  else if (spec.name == "plugin")
    out = open_plugin(spec, place);
  else if (spec.name == "bad-operator")
    out = open_bad_operator(spec, place);
  else if (spec.name == "scripted")
    out = open_scripted(spec, place);
  else if (spec.name == "replay")
    out = open_replay(spec);
  else if (spec.name == "arm")
    out = keep(device::SimulatedArm::open(place.path, {}, H6_IMPEDANCE));
  else
    out = hand_by_name(spec.name, place.path, place.grip);
  if (out) out->real_time = find_kind(spec.name)->real_time;
  return out;
}

void end_without_driver(const Console& console, const std::string& names) {
  set_signal_hook(nullptr, nullptr);
  const int code = console.fail("the device " + names + " has not answered for " +
                                std::to_string(std::lround(kDriverSilence)) +
                                " s: its driver hangs, and the program ends without it");
  std::fflush(nullptr);
  std::_Exit(code);
}

}  // namespace h6::cli
