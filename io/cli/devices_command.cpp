// SPDX-License-Identifier: Apache-2.0
// devices_command.cpp - hapsix devices: lists devices, explains why one cannot be used, watches one
// and tests one.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "device/spacemouse.h"
#include "hapsix/vector.h"
#include "io/cli/commands.h"
#include "io/cli/device_check.h"
#include "io/console/checks.h"
#include "io/run/open_device.h"

namespace h6::cli {
namespace {

using nlohmann::ordered_json;

struct DevicesOptions {
  std::string device;
  bool watch = false, test = false, rules = false;
  double duration = 0;  // 0: until interrupted [s]
};

const char* layout_name(device::ReportLayout layout) {
  if (layout == device::ReportLayout::split) return "two reports";
  return layout == device::ReportLayout::joint ? "one report" : "unknown, the reports will tell";
}

// Every SpaceMouse that is plugged in, and whether it can be opened.
ordered_json caps() {
  ordered_json list = ordered_json::array();
  for (const device::SpaceMouseInfo& found : device::list_spacemice(device::system_hid())) {
    char id[16];
    std::snprintf(id, sizeof id, "%04x:%04x", found.hid.vendor_id, found.hid.product_id);
    const auto opened = device::system_hid().open(found.hid.path);
    list.push_back(
        {{"device", "spacemouse" +
                        (found.hid.serial.empty() ? std::string{} : "?serial=" + found.hid.serial)},
         {"product", found.hid.product},
         {"serial", found.hid.serial},
         {"id", id},
         {"path", found.hid.path},
         {"layout", layout_name(found.layout)},
         {"usable", static_cast<bool>(opened)},
         {"trouble", opened ? "" : opened.error()}});
  }
  return list;
}

int list_devices(const Console& console) {
  ordered_json kinds = ordered_json::array();
  for (const DeviceKind& kind : device_kinds())
    kinds.push_back({{"name", kind.name},
                     {"form", kind.form},
                     {"about", kind.about},
                     {"options", kind.options},
                     {"real_time", kind.real_time}});
  const ordered_json found = caps();
  std::string trouble;
  if (!device::built_with_hidapi())
    trouble = "this program was built without hidapi: install libhidapi-dev and build again";
  else if (found.empty())
    trouble = "no SpaceMouse is plugged in";
  console.result({{"devices", kinds}, {"spacemice", found}, {"trouble", trouble}});
  if (console.json) return kOk;
  std::printf("For 'hapsix run --device' and the key \"device\" of scenes:\n");
  for (const DeviceKind& kind : device_kinds()) {
    std::printf("  %-30s %s\n", kind.form, kind.about);
    if (kind.options[0]) std::printf("  %-30s   %s\n", "", kind.options);
  }
  std::printf("\nSpaceMouse:\n");
  for (const ordered_json& cap : found) {
    std::printf("  %-30s %s, %s\n", printable(cap["device"].get<std::string>()).c_str(),
                printable(cap["product"].get<std::string>()).c_str(),
                printable(cap["path"].get<std::string>()).c_str());
    if (!cap["usable"].get<bool>())
      std::printf("    cannot be used: %s\n", printable(cap["trouble"].get<std::string>()).c_str());
  }
  if (!trouble.empty()) std::printf("  %s\n", trouble.c_str());
  return kOk;
}

ordered_json vec(const h6Vec3& v) { return {v.x, v.y, v.z}; }

ordered_json capabilities(const OpenedDevice& opened, const std::string& text) {
  const h6DeviceCapabilities& c = opened.device.capabilities;
  ordered_json modes = ordered_json::array();
  if (c.modes & H6_IMPEDANCE) modes.push_back("impedance");
  if (c.modes & H6_ADMITTANCE) modes.push_back("admittance");
  if (c.modes & H6_PSEUDO_ADMITTANCE) modes.push_back("pseudo-admittance");
  return {{"device", text},
          {"name", std::string(c.name, strnlen(c.name, sizeof c.name))},
          {"about", opened.about},
          {"dof_in", c.dof_in},
          {"dof_out", c.dof_out},
          {"max_force", c.max_force},
          {"max_torque", c.max_torque},
          {"max_velocity", c.max_velocity},
          {"workspace_min", vec(c.workspace_min)},
          {"workspace_max", vec(c.workspace_max)},
          {"rate", c.rate},
          {"modes", modes}};
}

ordered_json counts(const SampleCount& s) {
  return {{"frames", s.frames},   {"failed", s.failed},           {"unusable", s.unusable},
          {"changed", s.changed}, {"read_us_max", s.read_us_max}, {"write_us_max", s.write_us_max}};
}

// Formats a sample as one line: millimetres, degrees, buttons, force.
std::string live_line(const h6DeviceSample& s, bool lost, const OpenedDevice& opened) {
  if (lost) return "lost";
  const double degrees = 57.29577951308232 * norm(turn({1, 0, 0, 0}, s.pose.q));
  char text[160];
  std::snprintf(text, sizeof text, "%+8.2f %+8.2f %+8.2f mm %6.1f deg  buttons %x  %.2f N ",
                1e3 * s.pose.p.x, 1e3 * s.pose.p.y, 1e3 * s.pose.p.z, degrees, s.buttons,
                norm(s.wrench.force));
  return text + (opened.live ? opened.live() : std::string{});
}

// A terminal shows one line, rewritten 20 times a second; a file gets a line every half second.
class LiveView {
 public:
  LiveView(const Console& console, const OpenedDevice& opened)
      : quiet_(console.json), terminal_(isatty(STDOUT_FILENO) != 0), opened_(opened) {}
  ~LiveView() {
    if (!quiet_ && terminal_) std::printf("\r\033[K");
  }
  bool operator()(double time, const h6DeviceSample& s, bool lost) {
    if (interrupted.load()) return false;
    if (quiet_ || time < next_) return true;
    next_ = time + (terminal_ ? 0.05 : 0.5);
    const std::string line = live_line(s, lost, opened_);
    std::printf(terminal_ ? "\r\033[K%s" : "%s\n", line.c_str());
    std::fflush(stdout);
    return true;
  }

 private:
  bool quiet_, terminal_;
  const OpenedDevice& opened_;
  double next_ = 0;
};

std::function<void()> gives_up(const Console& console, const OpenedDevice& opened) {
  return [&] {
    end_without_driver(console, std::string("'") + opened.device.capabilities.name + "'");
  };
}

int watch(const Console& console, const OpenedDevice& opened, ordered_json json, double seconds) {
  if (console.json && seconds == 0) seconds = 3;
  SampleCount seen;
  {
    LiveView view(console, opened);
    seen = watch_device(opened.device, seconds > 0 ? seconds : 1e9, std::ref(view),
                        gives_up(console, opened));
  }
  json["samples"] = counts(seen);
  console.result(json);
  if (!console.json)
    std::printf("%llu samples, %llu of them new, %llu unusable, lost in %llu\n",
                static_cast<unsigned long long>(seen.frames),
                static_cast<unsigned long long>(seen.changed),
                static_cast<unsigned long long>(seen.unusable),
                static_cast<unsigned long long>(seen.failed));
  return kOk;
}

int test(const Console& console, const OpenedDevice& opened, ordered_json json) {
  CheckResult result;
  {
    LiveView view(console, opened);
    result = check_device_by_pushes(opened.device, std::ref(view), gives_up(console, opened));
  }
  json["samples"] = counts(result.samples);
  ordered_json pushes = ordered_json::array();
  for (const Push& p : result.pushes)
    pushes.push_back({{"what", p.what}, {"applied", p.applied}, {"moved", p.moved}});
  json["pushes"] = pushes;
  json["passed"] = result.trouble.empty();
  if (!result.trouble.empty()) json["error"] = result.trouble;
  console.result(json);
  if (!console.json)
    for (const Push& p : result.pushes) {
      const bool torque = p.what[0] == 't';
      std::printf("  %-10s %6.3f %s  moved %+8.3f %s\n", p.what.c_str(), p.applied,
                  torque ? "N m" : "N  ", (torque ? 57.29577951308232 : 1e3) * p.moved,
                  torque ? "deg" : "mm");
    }
  if (result.trouble.empty()) {
    if (!console.json) std::printf("passed\n");
    return kOk;
  }
  console.log("hapsix: " + json["device"].get<std::string>() + ": " + result.trouble);
  return kFailed;
}

int devices_command(const Console& console, DevicesOptions o) {
  if (o.rules) {
    console.result({{"rules", device::udev_rules()}});
    if (!console.json) std::printf("%s", device::udev_rules());
    return kOk;
  }
  if (o.device.empty() && !o.watch && !o.test) return list_devices(console);
  if (o.device.empty()) o.device = "spacemouse";
  if (Outcome known = check_device(o.device); !known) return console.fail(known.error(), kUsage);
  DevicePlace place;
  place.path.time = {0};
  place.path.pose = {place.home};
  Result<OpenedDevice> opened = open_device(o.device, place);
  if (!opened) return console.fail(opened.error());
  ordered_json json = capabilities(*opened, o.device);
  if (!console.json) {
    std::printf("%s: %u in, %u out, %g N, %g N m\n",
                printable(opened->device.capabilities.name).c_str(),
                opened->device.capabilities.dof_in, opened->device.capabilities.dof_out,
                opened->device.capabilities.max_force, opened->device.capabilities.max_torque);
    if (!opened->about.empty()) std::printf("%s\n", printable(opened->about).c_str());
  }
  // The signal handler stops the motors at once. The view ends after that.
  set_signal_hook(
      [](void* context) {
        const auto& d = *static_cast<const h6Device*>(context);
        d.stop(d.self);
      },
      &opened->device);
  int code = kOk;
  if (o.test)
    code = test(console, *opened, json);
  else if (o.watch)
    code = watch(console, *opened, json, o.duration);
  else
    console.result(json);
  set_signal_hook(nullptr, nullptr);
  return code;
}

}  // namespace

void add_devices(CLI::App& app, Program& program) {
  CLI::App* devices = app.add_subcommand(
      "devices", "Hands there are, why one cannot be used, and what one says and does");
  auto o = std::make_shared<DevicesOptions>();
  devices
      ->add_option("DEVICE", o->device,
                   "As for 'run --device'; alone: what it can; with --watch and --test the default "
                   "is spacemouse")
      ->option_text("NAME");
  CLI::Option* watch = devices->add_flag("--watch", o->watch,
                                         "Show pose, buttons and axes as they come, without force");
  devices
      ->add_flag(
          "--test", o->test,
          "Check its samples, arm it, and push along every axis with 10 % of its rating: keep your "
          "hands off")
      ->excludes(watch);
  devices->add_option("--duration", o->duration, "Of --watch; default: until Ctrl-C")
      ->option_text("SECONDS")
      ->check(number_within(1e-3, 1e6));
  devices->add_flag("--udev-rules", o->rules,
                    "Print the rules that let everyone at this machine use a SpaceMouse");
  devices->callback([&program, o] {
    program.work = [&program, o] { return devices_command(program.console, *o); };
  });
}

}  // namespace h6::cli
