// SPDX-License-Identifier: Apache-2.0
#include "device/scripted_hand.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "device/forward_arm.h"
#include "hapsix/vector.h"

namespace h6::device {
namespace {

class Writer {
 public:
  Writer(double metres, const h6Pose& home, const h6Vec3& grip)
      : unit_(metres), grip_(grip), home_q_(h6::unit(home.q)), q_(home_q_) {
    home_x_ = x_ = home.p + rotate(q_, grip);
    keep();
  }

  // False when the line is not understood.
  bool line(std::istringstream& words, const std::string& verb) {
    if (verb == "hold") return hold(words);
    if (verb == "press" || verb == "release") return button(words, verb == "press");
    if (verb == "home") {
      double seconds;
      return in(words, seconds) && go(home_x_, turn(q_, home_q_), seconds);
    }
    if (verb != "move" && verb != "turn") return false;
    h6Vec3 v;
    double seconds;
    if (!(words >> v.x >> v.y >> v.z) || !in(words, seconds)) return false;
    if (!std::isfinite(v.x + v.y + v.z)) return false;
    if (verb == "move") return go(x_ + unit_ * v, {}, seconds);
    return norm(v) <= 36000 && go(x_, (3.14159265358979323846 / 180) * v, seconds);
  }

  HandScript script;

 private:
  static bool in(std::istringstream& words, double& seconds) {
    std::string word;
    return words >> word >> seconds && word == "in" && seconds > 0 && seconds <= 1e5;
  }
  bool hold(std::istringstream& words) {
    double seconds;
    if (!(words >> seconds) || !(seconds > 0 && seconds <= 1e5)) return false;
    return go(x_, {}, seconds);
  }
  bool button(std::istringstream& words, bool down) {
    int number;
    if (!(words >> number) || number < 0 || number > 31) return false;
    const std::uint32_t bit = 1u << number;
    buttons_ = down ? buttons_ | bit : buttons_ & ~bit;
    script.buttons.push_back({time_, buttons_});
    return true;
  }
  // Rows every few degrees, because between rows the mesh frame's origin moves on a straight line.
  bool go(const h6Vec3& to, const h6Vec3& turn_by, double seconds) {
    const h6Vec3 from = x_;
    const h6Quat q = q_;
    const double begun = time_;
    const int rows = std::clamp(static_cast<int>(std::ceil(norm(turn_by) / 0.035)), 1, 20000);
    for (int i = 1; i <= rows; ++i) {
      const double s = static_cast<double>(i) / rows;
      x_ = from + s * (to - from);
      q_ = turned(q, s * turn_by);
      time_ = begun + s * seconds;
      if (!(time_ > script.path.time.back())) return false;  // too short to get its own row
      keep();
    }
    return true;
  }
  void keep() {
    script.path.time.push_back(time_);
    script.path.pose.push_back({x_ - rotate(q_, grip_), q_});
  }

  double unit_, time_ = 0;
  h6Vec3 grip_, home_x_, x_;
  h6Quat home_q_, q_;
  std::uint32_t buttons_ = 0;
};

}  // namespace

Result<HandScript> read_hand_script(const std::string& text, double unit, const h6Pose& home,
                                    const h6Vec3& grip) {
  Writer writer(unit, home, grip);
  std::istringstream in(text);
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    if (++number > 10000) return Failure{"a hand script has at most 10000 lines"};
    std::istringstream words(line.substr(0, line.find('#')));
    std::string verb, more;
    if (!(words >> verb)) continue;
    if (!writer.line(words, verb) || words >> more) {
      const std::size_t shown = std::min<std::size_t>(line.size(), 60);
      std::string quoted;
      for (const char c : line.substr(0, shown)) quoted += c >= ' ' && c < 127 ? c : '?';
      return Failure{"line " + std::to_string(number) + " ('" + quoted +
                     "') is not one of: move DX DY DZ in SECONDS, turn RX RY RZ in SECONDS, home "
                     "in SECONDS, hold SECONDS, press N, release N"};
    }
  }
  return std::move(writer.script);
}

std::uint32_t ScriptedHand::pressed(double time) const {
  const auto after =
      std::upper_bound(buttons_.begin(), buttons_.end(), time,
                       [](double t, const HandScript::Buttons& b) { return t < b.time; });
  return after == buttons_.begin() ? 0 : (after - 1)->buttons;
}

h6Device ScriptedHand::device() {
  h6Device d = hand_;
  d.self = this;
  std::snprintf(d.capabilities.name, sizeof d.capabilities.name, "scripted");
  d.read = [](void* self, double time, h6DeviceSample* out) {
    auto& hand = *static_cast<ScriptedHand*>(self);
    const int failed = hand.hand_.read(hand.hand_.self, time, out);
    out->buttons |= hand.pressed(time);
    return failed;
  };
  d.write = [](void* self, double time, const h6DeviceCommand* command) {
    auto& hand = *static_cast<ScriptedHand*>(self);
    return hand.hand_.write(hand.hand_.self, time, command);
  };
  d.stop = [](void* self) {
    auto& hand = *static_cast<ScriptedHand*>(self);
    hand.hand_.stop(hand.hand_.self);
  };
  d.arm = [](void* self) { return arm(static_cast<ScriptedHand*>(self)->hand_); };
  return d;
}

}  // namespace h6::device
