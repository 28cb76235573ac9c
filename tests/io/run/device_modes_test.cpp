// SPDX-License-Identifier: Apache-2.0
// Runs scenes with a simulated arm in every device mode, with and without delay.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "device/simulated_arm.h"
#include "io/run/run_setup.h"
#include "io/scene/scene_settings.h"
#include "io/scenes/scenes.h"
#include "tests/io/load.h"
#include "tests/support/near.h"

using namespace h6;
using namespace h6::cli;
using h6::test::near;

namespace {

// A box of 10 mm height on a wall. The person who presses it aims 3 mm below the surface.
const io::LoadedScene& pressed_box() {
  static const std::unique_ptr<io::LoadedScene> loaded = [] {
    io::Scene scene = *io::make_scene("box-on-wall");
    h6Pose start = scene.hands[0].path[0].pose, end = start;
    end.p.z = 2e-3;
    scene.hands[0].path = {{0, start}, {0.05, start}, {0.35, end}};
    scene.duration = 2;
    return h6::test::load(std::move(scene));
  }();
  return *loaded;
}

struct Rest {
  double depth = 0, deepest = 0;  // depth at the end, and its maximum over the run [voxel]
  double late_speed = 0;          // RMS speed of the body over the last 0.2 s [m/s]
  double swing = 0;               // peak-to-peak height over the last 0.2 s [m]
  std::uint32_t contacts = 0;
  double force = 0;  // sum over the contacts, mean of the last 0.2 s [N]
  h6Status status = 0;
};

Rest press(std::uint32_t mode, int delay, const std::string& device = "arm") {
  RunSetup run(pressed_box());
  run.hand_defs[0].mode = mode;
  run.hands[0].device = device;
  run.hands[0].arm.emplace();
  run.hands[0].arm->delay_frames = delay;
  const Outcome opened = run.open();
  if (!opened) FAIL(opened.error());
  Rest rest;
  const double duration = run.loaded.duration();
  double speed2 = 0, low = 1, high = -1;
  int late = 0;
  for (int i = 0; i < static_cast<int>(duration * run.def.rate); ++i) {
    h6FrameRecord r{};
    r.time = i / run.def.rate;
    REQUIRE(run.step(r));
    rest.status |= r.report.status;
    rest.depth = r.report.max_depth_voxels;
    rest.deepest = std::max(rest.deepest, rest.depth);
    rest.contacts = r.report.contacts;
    if (r.time < duration - 0.2) continue;
    const h6Vec3& v = r.body[0].velocity.linear;
    speed2 += v.x * v.x + v.y * v.y + v.z * v.z, ++late;
    low = std::min(low, r.body[0].pose.p.z), high = std::max(high, r.body[0].pose.p.z);
    const h6Contacts c = h6GetContacts(run.session.get(), run.hand_defs[0].body);
    for (std::size_t k = 0; k < c.count; ++k) rest.force += run.def.contact.stiffness * c.load[k];
  }
  rest.late_speed = std::sqrt(speed2 / late);
  rest.swing = high - low;
  rest.force /= late;
  return rest;
}

std::string name(std::uint32_t mode) {
  return mode == H6_ADMITTANCE ? "admittance" : mode == H6_IMPEDANCE ? "impedance" : "pseudo";
}

}  // namespace

TEST_CASE("a box on a wall, held by an arm, rests in contact in every mode and with every delay") {
  const io::SceneArm arm;
  const io::LoadedScene& scene = pressed_box();
  const double person = 1 / arm.person_stiffness + 1 / arm.grip_stiffness,
               coupling = 1 / scene.scene.coupling.stiffness,
               driver = 1 / scene.hands[0].driver_stiffness;
  for (const std::uint32_t mode : {H6_IMPEDANCE, H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE})
    for (int delay = 0; delay <= 2; ++delay) {
      const Rest rest = press(mode, delay);
      INFO(name(mode), " delay ", delay, ": depth ", rest.depth, " voxel, deepest ", rest.deepest,
           ", speed ", 1e3 * rest.late_speed, " mm/s, swing ", 1e6 * rest.swing, " um, force ",
           rest.force, " N");
      CHECK(rest.contacts > 20);
      CHECK(rest.depth > 0);
      CHECK(rest.deepest < 0.1);
      CHECK(rest.late_speed < 0.5e-3);  // from the encoders' steps; chatter begins at 2 mm/s
      CHECK(rest.swing < 5e-6);
      CHECK((rest.status & (H6_STATE_NOT_FINITE | H6_HAND_NOT_FINITE | H6_OUTPUT_FAULT)) == 0);
      // The force is 3 mm divided by the compliance of the springs between the person and the box.
      const double give = person + (mode == H6_ADMITTANCE ? 0 : coupling) +
                          (mode == H6_PSEUDO_ADMITTANCE ? driver : 0);
      CHECK(rest.force == near(3e-3 / give).epsilon(0.04));
    }
}

TEST_CASE("a scene's figures of an arm are the simulated arm's own where it says nothing") {
  const io::SceneArm a;
  const device::ArmFigures b;
  CHECK(a.delay_frames == b.delay_frames);
  CHECK(a.mass == b.mass);
  CHECK(a.inertia == b.inertia);
  CHECK(a.damping == b.damping);
  CHECK(a.rotational_damping == b.rotational_damping);
  CHECK(a.position_step == b.position_step);
  CHECK(a.angle_step == b.angle_step);
  CHECK(a.force_step == b.force_step);
  CHECK(a.torque_step == b.torque_step);
  CHECK(a.exact_velocity == b.exact_velocity);
  CHECK(a.velocity_filter == b.velocity_filter);
  CHECK(a.stop_stiffness == b.stop_stiffness);
  CHECK(a.max_force == b.max_force);
  CHECK(a.max_torque == b.max_torque);
  CHECK(a.max_velocity == b.max_velocity);
  CHECK(a.servo_frequency == b.servo_frequency);
  CHECK(a.person_mass == b.person.mass);
  CHECK(a.person_inertia == b.person.inertia);
  CHECK(a.person_stiffness == b.person.stiffness);
  CHECK(a.person_damping == b.person.damping);
  CHECK(a.person_rotational_stiffness == b.person.rotational_stiffness);
  CHECK(a.person_rotational_damping == b.person.rotational_damping);
  CHECK(a.grip_stiffness == b.grip_stiffness);
  CHECK(a.grip_damping == b.grip_damping);
  CHECK(a.grip_rotational_stiffness == b.grip_rotational_stiffness);
  CHECK(a.grip_rotational_damping == b.grip_rotational_damping);
  CHECK(io::default_scene_hand().driver_stiffness == b.driver_stiffness);
  CHECK(io::default_scene_hand().driver_damping == b.driver_damping);
}

TEST_CASE("the arm's figures in a scene reach the arm") {
  RunSetup run(pressed_box());
  run.hands[0].device = "arm";
  run.hands[0].arm.emplace();
  run.hands[0].arm->max_force = 7;
  run.hands[0].arm->workspace.low = {-0.1, -0.1, -0.1};
  run.hands[0].arm->workspace.high = {0.1, 0.1, 0.2};
  run.hands[0].arm->position_step = 1e-3;
  REQUIRE(run.open());
  const h6DeviceCapabilities& c = run.devices.devices[0].capabilities;
  CHECK(c.max_force == 7);
  CHECK(c.workspace_max.z == 0.2);
  CHECK(c.modes == (H6_IMPEDANCE | H6_ADMITTANCE | H6_PSEUDO_ADMITTANCE));
  for (int i = 0; i < 300; ++i) {
    h6FrameRecord r{};
    r.time = 1e-3 * i;
    REQUIRE(run.step(r));
    CHECK(std::fabs(std::remainder(r.hand[0].pose.p.z, 1e-3)) < 1e-12);
  }
}

TEST_CASE("every figure of an arm in a scene changes what the arm does") {
  // The arm is tilted and starts against a stop, so that each of its figures has an effect.
  io::SceneArm base;
  base.workspace = {{-0.1, -0.1, 6.5e-3}, {0.1, 0.1, 0.1}};
  base.max_force = 2, base.max_torque = 0.02;
  io::Path path = pressed_box().scene.hands[0].path;
  path.back().pose.q = {std::cos(0.1), std::sin(0.1), 0, 0};
  const auto felt = [&](const io::SceneArm& arm) {
    std::vector<double> all;
    for (const std::uint32_t mode : {H6_IMPEDANCE, H6_ADMITTANCE}) {
      RunSetup run(pressed_box());
      run.hand_defs[0].mode = mode;
      run.hands[0].device = "arm";
      run.hands[0].path = path;
      run.hands[0].arm = arm;
      const Outcome opened = run.open();
      if (!opened) FAIL(opened.error());
      all.push_back(run.devices.devices[0].capabilities.max_velocity);
      for (int i = 0; i < 400; ++i) {
        h6FrameRecord r{};
        r.time = 1e-3 * i;
        REQUIRE(run.step(r));
        const h6DeviceSample& s = r.hand[0];
        for (const double x : {s.pose.p.y, s.pose.p.z, s.pose.q.x, s.velocity.linear.z,
                               s.wrench.force.z, s.wrench.torque.x})
          all.push_back(x);
      }
    }
    return all;
  };
  const std::vector<double> before = felt(base);
  CHECK(felt(base) == before);
  for (const Setting& figure : io::arm_settings()) {
    if (figure.kind != SettingKind::number) continue;
    CAPTURE(std::string(figure.name));
    io::SceneArm arm = base;
    void* const value = figure.member.make(&arm);
    figure.member.set_number(value, 0.9 * figure.member.number(value));
    CHECK(felt(arm) != before);
  }
}

TEST_CASE("devices that the mode or the name does not fit are refused with a sentence") {
  const auto refused = [](const std::string& device, std::uint32_t mode, double mass = 0.3) {
    RunSetup run(pressed_box());
    run.hands[0].device = device;
    run.hands[0].arm.emplace();
    run.hands[0].arm->mass = mass;
    run.hand_defs[0].mode = mode;
    const Outcome opened = run.open();
    return opened ? std::string() : opened.error();
  };
  CHECK(refused("path", H6_IMPEDANCE).empty());
  CHECK(refused("simulated", H6_IMPEDANCE).empty());
  CHECK(refused("arm", H6_ADMITTANCE).empty());
  for (const char* device : {"path", "simulated"}) {
    const std::string sentence = refused(device, H6_ADMITTANCE);
    CHECK(sentence.find("hand of 'box'") != std::string::npos);
    CHECK(sentence.find("'arm'") != std::string::npos);
  }
  CHECK(refused("phantom", H6_IMPEDANCE).find("no device is called 'phantom'") !=
        std::string::npos);
  CHECK(refused("arm", H6_IMPEDANCE, 0).find("mass of the simulated arm") != std::string::npos);
}
