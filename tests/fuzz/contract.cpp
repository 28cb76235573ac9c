// SPDX-License-Identifier: Apache-2.0
// contract.cpp - the bytes choose definitions, calls and samples of one part on a floor. Whatever
// they choose: no crash, and every command is finite and inside the rating.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "hapsix/hapsix.h"
#include "tests/fuzz/targets.h"
#include "tests/support/analytic.h"

namespace h6::fuzz {
namespace {

constexpr double mm = 1e-3;

class Bytes {
 public:
  explicit Bytes(std::string_view bytes) : rest_(bytes) {}
  bool empty() const { return rest_.empty(); }
  std::uint8_t byte() {
    if (rest_.empty()) return 0;
    const auto value = static_cast<std::uint8_t>(rest_[0]);
    rest_.remove_prefix(1);
    return value;
  }
  std::int32_t index() {
    static constexpr std::int32_t odd[] = {-1, 2, 256, INT32_MAX, INT32_MIN};
    const unsigned b = byte();
    return b < 200 ? static_cast<std::int32_t>(b & 1) : odd[b % std::size(odd)];
  }
  // Mostly near `usual`; now and then any bits.
  double number(double usual) {
    static constexpr double odd[] = {0, -1, 1e-30, 1e9, 1e300, -1e300};
    const unsigned b = byte();
    if (b < 128) return usual * (b + 1) / 64;
    if (b < 160) return odd[b % std::size(odd)];
    if (b < 170) return b & 1 ? std::nan("") : std::numeric_limits<double>::infinity();
    if (b < 250) return usual;
    std::uint64_t bits = 0;
    for (int i = 0; i < 8; ++i) bits = bits << 8 | byte();
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

 private:
  std::string_view rest_;
};

const test::Model& model() {
  static test::FieldArrays field = test::sample_analytic(
      [](double, double, double z) { return z; }, {-16 * mm, -16 * mm, -8 * mm}, mm, 4, 4, 2);
  static test::ShellArrays shell = test::bottom_face(5 * mm, 5 * mm, 2 * mm, 6, 6);
  static const test::Model made{{test::def_of(field)}, {shell.def()}};
  return made;
}

h6SessionDef session_def(Bytes& in, h6BodyDef (&bodies)[2], h6HandDef& hand) {
  h6SessionDef def = h6DefaultSessionDef();
  bodies[0] = bodies[1] = h6DefaultBodyDef();
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0, bodies[1].pose.p.z = 2.2 * mm;
  hand = h6DefaultHandDef();
  hand.body = 1;
  for (unsigned changes = in.byte() % 8; changes > 0; --changes) switch (in.byte() % 20) {
      case 0:
        bodies[1].mass = in.number(0.1);
        break;
      case 1:
        bodies[1].pose.p.z = in.number(2 * mm);
        break;
      case 2:
        bodies[1].inertia[in.byte() % 6] = in.number(1e-6);
        break;
      case 3:
        bodies[1].com.x = in.number(mm);
        break;
      case 4:
        hand.filter.motion_scale = in.number(1);
        break;
      case 5:
        hand.filter.force_scale = in.number(1);
        break;
      case 6:
        hand.mode = 1u << in.byte() % 4;
        break;
      case 7:
        hand.coupling.mode = static_cast<h6CouplingMode>(in.byte() % 4);
        break;
      case 8:
        hand.coupling.stiffness = in.number(1e3);
        break;
      case 9:
        def.contact.method = static_cast<h6Method>(in.byte() % 9);
        break;
      case 10:
        def.contact.stiffness = in.number(1e4);
        break;
      case 11:
        def.contact.friction = in.number(0.3);
        break;
      case 12:
        def.rate = in.number(1000);
        break;
      case 13:
        def.gravity.z = in.number(-9.81);
        break;
      case 14:
        def.max_contacts = in.byte();
        break;
      case 15:
        hand.passivity = true, hand.delay_frames = in.byte() % 4;
        break;
      case 16:
        hand.manipulandum_mass = in.number(0.1);
        break;
      case 17:
        hand.body = in.index();
        break;
      case 18:
        bodies[1].field = in.index();
        break;
      default:
        def.contact.damping = in.number(1e-3);
        break;
    }
  def.bodies = bodies, def.body_count = 2;
  def.hands = &hand, def.hand_count = 1;
  return def;
}

void call(h6Session* s, Bytes& in) {
  switch (in.byte() % 12) {
    case 0: {
      h6BodyState state{{{0, 0, in.number(2 * mm)}, {1, in.number(0), 0, 0}}, {}};
      h6SetBody(s, in.index(), &state);
      break;
    }
    case 1:
      h6Fault(s, static_cast<h6Cause>(static_cast<std::int8_t>(in.byte())));
      break;
    case 2:
      h6Arm(s);
      break;
    case 3:
      h6Disarm(s);
      break;
    case 4:
      h6LoseDevice(s, in.index());
      break;
    case 5:
      h6NoteInterval(s, in.number(1e-3));
      break;
    case 6: {
      const h6SafetyInput input{in.byte() * 7919u, in.number(1e-3)};
      h6SetSafetyInput(s, in.index(), &input);
      break;
    }
    case 7:
      h6SetCoarse(s, in.byte(), in.byte());
      break;
    case 8: {
      h6DeviceCapabilities rating{};
      rating.max_force = in.number(10), rating.max_torque = in.number(1);
      rating.max_force_rate = in.number(1000), rating.max_velocity = in.number(1);
      rating.freeze_time = in.number(0.1);
      h6SetRating(s, in.index(), &rating);
      break;
    }
    case 9:
      (void)h6GetContacts(s, in.index());
      break;
    case 10:
      h6NameContacts(s, in.index(), nullptr, nullptr);
      break;
    default:
      (void)h6RestartFit(s, nullptr);
      break;
  }
}

void check(const h6DeviceCommand& c) {
  const double all[] = {c.wrench.force.x,  c.wrench.force.y,  c.wrench.force.z, c.wrench.torque.x,
                        c.wrench.torque.y, c.wrench.torque.z, c.pose.p.x,       c.pose.p.y,
                        c.pose.p.z,        c.pose.q.w,        c.pose.q.x,       c.pose.q.y,
                        c.pose.q.z};
  for (const double value : all) promise(std::isfinite(value), "a command is finite");
  promise(std::hypot(all[0], all[1], all[2]) <= 100.001, "a force is inside the rating");
  promise(std::hypot(all[3], all[4], all[5]) <= 10.0001, "a torque is inside the rating");
  promise(c.cause >= 0 && c.cause < H6_CAUSE_COUNT, "a cause has a name");
}

}  // namespace

void take_contract(std::string_view bytes) {
  Bytes in(bytes);
  h6BodyDef bodies[2];
  h6HandDef hand;
  const h6SessionDef def = session_def(in, bodies, hand);
  h6Error error{};
  h6Session* s = h6CreateSession(model().handle, &def, &error);
  if (!s) return promise(error.message[0] != 0, "a refusal has a sentence");
  h6DeviceSample sample{};
  sample.pose = {{0, 0, 2.2 * mm}, {1, 0, 0, 0}};
  for (int frame = 0; frame < 64 && !in.empty(); ++frame) {
    const unsigned what = in.byte();
    if (what < 64) call(s, in);
    if (what >= 64 && what < 192) sample.pose.p.z = in.number(2 * mm);
    if (what >= 192 && what < 208) sample.pose.q.x = in.number(0.1);
    if (what >= 208 && what < 224) sample.velocity.linear.z = in.number(0.1);
    if (what >= 224 && what < 240) sample.wrench.force.z = in.number(1);
    if (what >= 240) sample.buttons = in.byte(), sample.sequence += in.byte() & 1;
    h6DeviceCommand command{};
    (void)h6Step(s, &sample, &command);
    check(command);
    const h6BodyState state = h6GetBody(s, 1);
    promise(std::isfinite(state.pose.p.x + state.pose.p.y + state.pose.p.z), "a body is somewhere");
  }
  h6DestroySession(s);
}

}  // namespace h6::fuzz
