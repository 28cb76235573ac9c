// SPDX-License-Identifier: Apache-2.0
// vendor_device.h - what the adapters for vendors' libraries have in common. An adapter derives
// from VendorDevice and says how its device is opened, read and written.
//
// Threads. One thread talks to the device, a turn a millisecond: state in, wrench out. It is ours,
// or the vendor's own servo loop. The haptic thread meets it in the mailbox, so no call of a
// vendor's, which may wait for a cable or a network, holds it up.
//
// Safety. The motors have no power before a person arms the device. A call that reports an error, a
// state that is not finite or no rotation, and a turn that comes too late are a fault: zero force,
// no power, and read says that the device is lost. Good states may follow; zero force stays until a
// person arms it again. A host that is silent for 20 ms gets zero force as well (mailbox.h).
//
// Axes. The option `axes` says which of the device's axes are the world's x, y and z: -yxz means
// that the world's x is the device's -y. Each adapter's default gives x towards the person, y to
// the right and z up.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include "device/plugins/mailbox.h"

namespace h6::plugin {

constexpr double kSoftStart = 0.1;  // after the device held its own force back [s]

// A device's state in its own axes.
struct State {
  double position[3], turn[4] = {1, 0, 0, 0}, linear[3] = {}, angular[3] = {};  // SI
  unsigned buttons = 0;
  bool fresh = true;    // false: the values are those of the last turn
  bool renders = true;  // false: the device holds its force back by itself
};

struct Axes {
  int of[3] = {0, 1, 2};
  double sign[3] = {1, 1, 1};
  void to_world(const double v[3], double out[3]) const {
    for (int i = 0; i < 3; ++i) out[i] = sign[i] * v[of[i]];
  }
  void to_device(const double v[3], double out[3]) const {
    for (int i = 0; i < 3; ++i) out[of[i]] = sign[i] * v[i];
  }
  // False: not each axis once, or a mirror image.
  bool parse(const std::string& text) {
    int n = 0;
    bool used[3] = {};
    double next = 1;
    for (const char c : text) {
      const int axis = c - 'x';
      if (c == '-' && next > 0) {
        next = -1;
      } else if (n < 3 && axis >= 0 && axis < 3 && !used[axis]) {
        of[n] = axis, sign[n++] = next, used[axis] = true, next = 1;
      } else {
        return false;
      }
    }
    const double parity = (of[1] - of[0] + 3) % 3 == 1 ? 1 : -1;
    return n == 3 && next > 0 && parity * sign[0] * sign[1] * sign[2] > 0;
  }
};

inline constexpr const char* kNoRotation = "its orientation is no rotation";

// Whether a matrix turns and does nothing else, as near as a sensor can tell.
inline bool is_rotation(const double m[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) {
      const double dot = m[i][0] * m[j][0] + m[i][1] * m[j][1] + m[i][2] * m[j][2];
      if (!(std::fabs(dot - (i == j)) < 0.05)) return false;
    }
  const double* a = m[0];
  const double *b = m[1], *c = m[2];
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
             a[2] * (b[0] * c[1] - b[1] * c[0]) >
         0;
}

class VendorDevice {
 public:
  VendorDevice(double force, double most_force, double torque, double most_torque)
      : max_force_(force),
        max_torque_(torque),
        most_force_(most_force),
        most_torque_(most_torque) {}
  virtual ~VendorDevice() = default;

  // The functions of the plug-in. `open` returns a sentence, or nothing.
  std::string open(const h6PluginStart& start, h6PluginCapabilities* can);
  int read(h6PluginSample* out);
  int write(const h6PluginCommand& command) { return box_.command(command), 0; }
  void stop() { armed_ = 0; }
  int arm();
  void close();

 protected:
  // An adapter brings these. connect fills in name and degrees of freedom, and may lower the
  // ratings.
  virtual bool option(const std::string& key, const std::string& value, std::string& wrong) = 0;
  virtual const char* own_options() const = 0;
  virtual std::string connect(h6PluginCapabilities& can) = 0;
  virtual void disconnect() = 0;
  // Within a turn. False: a fault; reason() is the vendor's word for it.
  virtual bool read_state(State& out) = 0;
  virtual bool write_wrench(const double force[3], const double torque[3]) = 0;
  virtual bool power(bool on) = 0;
  virtual const char* reason() { return ""; }
  // After a second of faults: the device may have been unplugged.
  virtual void connect_again() {}
  // Where turns come from. The last turn is over when end returns.
  virtual std::string begin();
  virtual void end();

  bool turn();
  bool armed() const { return arming() != 0; }

  std::string library_;
  Axes axes_;
  double max_force_, max_torque_;  // [N], [N m]
  double patience_ = 0.1;          // option timeout: the oldest state that counts [s]
  double late_ = 0.1;              // a turn after a longer pause is a fault [s]
  double turn_time_ = 1e-3;        // of our own thread [s]
  const char* wrong_ = nullptr;    // an adapter's own word for a fault, in place of reason()

 private:
  std::string parse(const h6PluginStart& start);
  bool common_option(const std::string& key, const std::string& value, std::string& wrong);
  void put(const State& s);
  bool fault();
  void run();
  // The number of the arming that holds; 0: none, or a fault came after it.
  std::uint32_t arming() const {
    const std::uint64_t a = armed_.load();
    return static_cast<std::uint32_t>(a) == faults_.load() ? static_cast<std::uint32_t>(a >> 32)
                                                           : 0;
  }

  h6PluginStart start_{};
  double most_force_, most_torque_;
  Mailbox box_;
  std::atomic<std::uint32_t> faults_{0};
  std::atomic<std::uint64_t> armed_{0};  // number of an arming, and of the faults before it
  // The haptic thread's.
  std::uint32_t armings_ = 0, seen_ = 0;
  bool there_ = false;
  // The device's thread's.
  std::unique_ptr<State> first_;
  std::uint64_t count_ = 0;
  std::uint32_t powered_ = 0;  // the arming for which the motors got their power
  double written_ = 0, share_ = 1;
  std::atomic<const char*> why_{""};
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

inline bool VendorDevice::common_option(const std::string& key, const std::string& value,
                                        std::string& wrong) {
  const double number = std::atof(value.c_str());
  const auto rating = [&](double& out, double most, const char* unit) {
    char limit[64];
    std::snprintf(limit, sizeof limit, " must be above 0 and at most %g %s, not ", most, unit);
    if (!(number > 0 && number <= most)) wrong = key + limit + value;
    out = number;
  };
  if (key == "library") {
    library_ = value;
  } else if (key == "axes") {
    if (!axes_.parse(value))
      wrong = "axes must be a right-handed order like zxy or -yxz, not " + value;
  } else if (key == "timeout") {
    if (!(number >= 5 && number <= 1000)) wrong = "timeout must be 5 to 1000 ms, not " + value;
    patience_ = late_ = 1e-3 * number;
  } else if (key == "max_force") {
    rating(max_force_, most_force_, "N");
  } else if (key == "max_torque") {
    rating(max_torque_, most_torque_, "N m");
  } else {
    return false;
  }
  return true;
}

inline std::string VendorDevice::parse(const h6PluginStart& start) {
  std::string wrong;
  for (std::size_t i = 0; i < start.option_count && wrong.empty(); ++i) {
    const std::string key = start.options[i].key, value = start.options[i].value;
    if (!common_option(key, value, wrong) && !option(key, value, wrong) && wrong.empty())
      wrong = std::string("the options are library, axes, timeout, max_force, max_torque") +
              own_options() + ", not " + key;
  }
  return wrong;
}

inline std::string VendorDevice::open(const h6PluginStart& start, h6PluginCapabilities* can) {
  std::string wrong = parse(start);
  if (!wrong.empty()) return wrong;
  start_ = start;
  start_.options = nullptr, start_.option_count = 0;
  can->dof_in = 6, can->dof_out = 3;
  if (wrong = connect(*can); !wrong.empty()) return wrong;
  if (can->dof_out < 6) max_torque_ = 0;
  if (wrong = begin(); !wrong.empty()) {
    disconnect();
    return wrong;
  }
  h6PluginSample sample;
  for (const double begun = now(); read(&sample) != 0;) {
    if (now() - begun > (*why_.load() ? 1 : 3)) {
      close();
      const std::string why = why_.load();
      return std::string(can->name) + " is open and gives no place" +
             (why.empty() ? " within 3 s" : ": " + why);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  can->max_force = max_force_, can->max_torque = max_torque_;
  can->rate = 1 / turn_time_;
  // A silent device is lost after the timeout; the host would call it frozen before.
  can->freeze_time = 2 * patience_;
  can->modes = H6_PLUGIN_IMPEDANCE;
  return "";
}

inline void VendorDevice::close() {
  stop();
  // The thread of a call that never returns is not left to itself: the host keeps what hangs
  // loaded.
  end();
  disconnect();
}

inline int VendorDevice::read(h6PluginSample* out) {
  const std::uint32_t faults = faults_.load();
  there_ = box_.get(start_, patience_, out) && faults == seen_;
  seen_ = faults;  // a fault that is over before anyone looked is reported once
  if (!there_) armed_ = 0;
  return there_ ? 0 : 1;
}

inline int VendorDevice::arm() {
  if (!there_) return 1;
  if (++armings_ == 0) armings_ = 1;
  armed_ = static_cast<std::uint64_t>(armings_) << 32 | seen_;
  return 0;
}

// One exchange. False: a fault.
inline bool VendorDevice::turn() {
  State s;
  wrong_ = nullptr;
  if (!read_state(s)) return fault();
  double length = 0;
  bool right = true;
  for (int i = 0; i < 3; ++i)
    right = right && std::fabs(s.position[i]) < 10 && std::fabs(s.linear[i]) < 100 &&
            std::fabs(s.angular[i]) < 1000;
  for (const double q : s.turn) length += q * q;
  if (!right || !(std::fabs(length - 1) < 0.2)) return wrong_ = "its place is no place", fault();
  for (double& q : s.turn) q /= std::sqrt(length);
  if (written_ > 0 && now() - written_ > late_) ++faults_;  // the last force has stood for so long
  if (s.fresh) put(s);

  const std::uint32_t arming_now = arming();
  if (arming_now && arming_now != powered_ && !power(true)) return fault();
  if (arming_now) powered_ = arming_now;
  share_ = s.renders ? std::min(1.0, share_ + turn_time_ / kSoftStart) : 0;
  const Wanted w = arming_now ? box_.wrench() : Wanted{};
  const auto scaled = [&](const double v[3], double most, double out[3]) {
    const double norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const double factor = !std::isfinite(norm) ? 0 : norm > most ? share_ * most / norm : share_;
    double world[3];
    for (int i = 0; i < 3; ++i) world[i] = factor > 0 ? factor * v[i] : 0;
    axes_.to_device(world, out);
  };
  double force[3], torque[3];
  scaled(w.force, max_force_, force), scaled(w.torque, max_torque_, torque);
  written_ = now();
  return write_wrench(force, torque) || fault();
}

inline bool VendorDevice::fault() {
  ++faults_;
  box_.lose();
  if (const char* why = wrong_ ? wrong_ : reason(); why && *why) why_ = why;
  const double zero[3] = {};
  (void)write_wrench(zero, zero);
  (void)power(false);
  powered_ = 0, written_ = 0;
  return false;
}

// Motion counts from the first state ever, so a device that was plugged in again has the same home.
inline void VendorDevice::put(const State& s) {
  if (!first_) first_ = std::make_unique<State>(s);
  Heard h;
  double moved[3], turned[4];
  for (int i = 0; i < 3; ++i) moved[i] = s.position[i] - first_->position[i];
  h6_turned(s.turn, first_->turn, turned);
  h.grip.turned[0] = turned[0];
  axes_.to_world(turned + 1, h.grip.turned + 1);
  axes_.to_world(moved, h.grip.moved);
  axes_.to_world(s.linear, h.grip.linear);
  axes_.to_world(s.angular, h.grip.angular);
  h.buttons = s.buttons;
  h.sequence = ++count_;
  h.at = now();
  box_.put(h);
}

inline std::string VendorDevice::begin() {
  thread_ = std::thread([this] { run(); });
  return "";
}
inline void VendorDevice::end() {
  ended_ = true;
  thread_.join();
}
inline void VendorDevice::run() {
  using std::chrono::steady_clock;
  const auto pause = [](double s) { return std::chrono::microseconds(std::lround(1e6 * s)); };
  int bad = 0;
  for (auto next = steady_clock::now(); !ended_; std::this_thread::sleep_until(next)) {
    if (turn())
      bad = 0;
    else if (++bad % 50 == 0)
      connect_again();
    next = std::max(next + pause(bad ? 0.02 : turn_time_), steady_clock::now());
  }
  const double zero[3] = {};
  (void)write_wrench(zero, zero);
  (void)power(false);
}

// A plug-in's table. `Adapter` has a constructor without arguments.
template <class Adapter>
constexpr h6DevicePluginV1 plugin_of(const char* about) {
  h6DevicePluginV1 p{};
  p.abi = H6_PLUGIN_ABI, p.size = sizeof p, p.about = about;
  p.open = [](const h6PluginStart* start, h6PluginCapabilities* can, void** device, char* error,
              std::size_t size) {
    std::string wrong;
    try {
      auto made = std::make_unique<Adapter>();
      VendorDevice* d = made.get();
      wrong = d->open(*start, can);
      if (wrong.empty()) return *device = d, (void)made.release(), 0;
    } catch (const std::exception& e) {
      wrong = e.what();
    }
    std::snprintf(error, size, "%s", wrong.c_str());
    return 1;
  };
  p.read = [](void* d, double, h6PluginSample* out) {
    return static_cast<VendorDevice*>(d)->read(out);
  };
  p.write = [](void* d, double, const h6PluginCommand* command) {
    return static_cast<VendorDevice*>(d)->write(*command);
  };
  p.stop = [](void* d) { static_cast<VendorDevice*>(d)->stop(); };
  p.arm = [](void* d) { return static_cast<VendorDevice*>(d)->arm(); };
  p.close = [](void* d) {
    std::unique_ptr<VendorDevice> device(static_cast<VendorDevice*>(d));
    device->close();
  };
  return p;
}

}  // namespace h6::plugin
