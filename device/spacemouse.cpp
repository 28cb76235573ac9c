// SPDX-License-Identifier: Apache-2.0
#include "device/spacemouse.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "hapsix/vector.h"

namespace h6::device {
namespace {

constexpr int kWait = 20;                                 // ms between looks at the LED
constexpr auto kSearch = std::chrono::milliseconds(250);  // between looks for an unplugged device

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

bool same_device(const HidInterface& a, const HidInterface& b) {
  return a.vendor_id == b.vendor_id && a.product_id == b.product_id && a.serial == b.serial;
}

}  // namespace

std::vector<SpaceMouseInfo> list_spacemice(HidPort& port) {
  std::vector<SpaceMouseInfo> found;
  for (HidInterface& hid : port.list()) {
    if (!is_spacemouse(hid.vendor_id, hid.product_id, hid.usage_page, hid.usage)) continue;
    const bool seen = std::any_of(found.begin(), found.end(), [&](const SpaceMouseInfo& other) {
      return other.hid.path == hid.path;  // hidapi lists a path once for each collection
    });
    if (seen) continue;
    const ReportLayout layout = layout_of_descriptor(hid.descriptor);
    found.push_back({std::move(hid), layout});
  }
  return found;
}

Result<std::unique_ptr<SpaceMouse>> SpaceMouse::open(HidPort& port,
                                                     const SpaceMouseOptions& options,
                                                     const h6Pose& home, const h6Vec3& grip) {
  if (Outcome good = check_rate_figures(options.rate); !good) return good.failure();
  if (!(options.led_force > 0)) return Failure{"the LED needs a force above 0 to be lit by"};
  std::unique_ptr<SpaceMouse> mouse(new SpaceMouse(port, options, home, grip));
  std::string trouble;
  if (!mouse->connect(trouble)) return Failure{trouble};
  mouse->present_.store(true);
  mouse->thread_ = std::thread([raw = mouse.get()] { raw->run(); });
  return mouse;
}

SpaceMouse::SpaceMouse(HidPort& port, const SpaceMouseOptions& options, const h6Pose& home,
                       const h6Vec3& grip)
    : port_(port), options_(options), rate_(options.rate, home, grip) {
  last_ = rate_.step({}, 0, {}, 0);
}

SpaceMouse::~SpaceMouse() {
  ending_.store(true);
  if (thread_.joinable()) thread_.join();
}

// The first call takes any device that fits; later calls only the same device.
bool SpaceMouse::connect(std::string& trouble) {
  const bool again = !hid_.path.empty();
  trouble = options_.serial.empty()
                ? "no SpaceMouse is plugged in"
                : "no SpaceMouse with the serial number '" + options_.serial + "' is plugged in";
  if (!built_with_hidapi() && &port_ == &system_hid())
    trouble = "this program was built without hidapi: install libhidapi-dev and build again";
  for (SpaceMouseInfo& found : list_spacemice(port_)) {
    if (again ? !same_device(found.hid, hid_)
              : !options_.serial.empty() && found.hid.serial != options_.serial)
      continue;
    Result<std::unique_ptr<HidHandle>> opened = port_.open(found.hid.path);
    if (!opened) {
      trouble = opened.error();
      continue;
    }
    handle_ = std::move(*opened);
    hid_ = std::move(found.hid);
    layout_ = found.layout;
    return true;
  }
  return false;
}

void SpaceMouse::run() {
  const std::uint8_t dark[] = {0x04, 0};
  while (!ending_.load(std::memory_order_relaxed)) {
    if (handle_) {
      drain(kWait);
      if (handle_) light();
      continue;
    }
    for (auto waited = kSearch; waited.count() > 0 && !ending_.load();
         waited -= std::chrono::milliseconds(10))
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    std::string trouble;
    if (ending_.load() || !connect(trouble)) continue;
    led_ = false;
    replugs_.fetch_add(1, std::memory_order_relaxed);
    present_.store(true, std::memory_order_release);
  }
  if (handle_ && led_) (void)handle_->write(dark);
}

// Reads all queued reports and keeps the newest: an old deflection must not move the hand late.
void SpaceMouse::drain(int timeout_ms) {
  std::array<std::uint8_t, 64> report;
  bool fresh = false;
  std::uint64_t taken = 0;
  for (int queued = 0; queued < 1000; ++queued) {
    const int bytes = handle_->read(report, queued == 0 ? timeout_ms : 0);
    if (bytes < 0) return gone();
    if (bytes == 0) break;
    const std::span<const std::uint8_t> got(
        report.data(), std::min(report.size(), static_cast<std::size_t>(bytes)));
    const ReportKind kind = take_report(got, layout_, newest_.state);
    ++taken;
    if (kind == ReportKind::ignored) continue;
    if (kind == ReportKind::motion) newest_.moved_ns = now_ns();
    fresh = true;
  }
  if (fresh) {
    to_hand_.publish(newest_);
    to_status_.publish(newest_);
  }
  reports_.fetch_add(taken, std::memory_order_release);
}

void SpaceMouse::gone() {
  handle_.reset();
  const int battery = newest_.state.battery;
  newest_ = {};
  newest_.state.battery = battery;
  to_hand_.publish(newest_);
  to_status_.publish(newest_);
  lit_.store(false, std::memory_order_relaxed);
  present_.store(false, std::memory_order_release);
}

// The LED is on from led_force and off below half of it. A device without an LED refuses the
// report; that does no harm.
void SpaceMouse::light() {
  const double felt = felt_force_.load(std::memory_order_relaxed);
  const bool stopped = stopped_.load(std::memory_order_relaxed);
  const bool want = !stopped && felt >= (led_ ? 0.5 : 1.0) * options_.led_force;
  if (want == led_) return;
  const std::uint8_t report[] = {0x04, static_cast<std::uint8_t>(want)};
  (void)handle_->write(report);
  led_ = want;
  lit_.store(want, std::memory_order_relaxed);
}

int SpaceMouse::read(double time, h6DeviceSample* out) {
  const double dt = std::max(0.0, time - time_);
  time_ = time;
  to_hand_.take(taken_);
  if (!present_.load(std::memory_order_acquire)) {
    if (was_present_) rate_.halt();
    was_present_ = false;
    last_.velocity = {};
    last_.buttons = 0;
    *out = last_;
    return 1;
  }
  was_present_ = true;
  std::array<double, 6> axes{};
  if (static_cast<double>(now_ns() - taken_.moved_ns) < 1e9 * kStale)
    for (std::size_t i = 0; i < 6; ++i)
      axes[i] = static_cast<double>(taken_.state.axis[i]) / kSpaceMouseFull;
  const h6Wrench felt = stopped_.load(std::memory_order_relaxed) ? h6Wrench{} : felt_;
  *out = last_ = rate_.step(axes, taken_.state.buttons, felt, dt);
  return 0;
}

h6Device SpaceMouse::device() {
  h6Device d{};
  d.self = this;
  h6DeviceCapabilities& c = d.capabilities;
  std::snprintf(c.name, sizeof c.name, "%s",
                hid_.product.empty() ? "SpaceMouse" : hid_.product.c_str());
  c.dof_in = 6;
  c.dof_out = 0;
  c.max_force = options_.shown_force;
  c.max_torque = options_.shown_torque;
  c.modes = H6_IMPEDANCE;
  d.read = [](void* self, double time, h6DeviceSample* out) {
    return static_cast<SpaceMouse*>(self)->read(time, out);
  };
  d.write = [](void* self, double, const h6DeviceCommand* command) {
    auto& mouse = *static_cast<SpaceMouse*>(self);
    mouse.felt_ = command->wrench;
    mouse.felt_force_.store(norm(command->wrench.force), std::memory_order_relaxed);
    mouse.felt_torque_.store(norm(command->wrench.torque), std::memory_order_relaxed);
    return mouse.present_.load(std::memory_order_relaxed) ? 0 : 1;
  };
  d.stop = [](void* self) {
    static_cast<SpaceMouse*>(self)->stopped_.store(true, std::memory_order_relaxed);
  };
  d.arm = [](void* self) {
    static_cast<SpaceMouse*>(self)->stopped_.store(false, std::memory_order_relaxed);
    return 0;
  };
  return d;
}

SpaceMouse::Status SpaceMouse::status() const {
  Status s;
  s.present = present_.load(std::memory_order_acquire);
  s.reports = reports_.load(std::memory_order_acquire);
  s.replugs = replugs_.load(std::memory_order_relaxed);
  s.led = lit_.load(std::memory_order_relaxed);
  s.felt_force = felt_force_.load(std::memory_order_relaxed);
  s.felt_torque = felt_torque_.load(std::memory_order_relaxed);
  to_status_.take(shown_);
  s.state = shown_.state;
  return s;
}

}  // namespace h6::device
