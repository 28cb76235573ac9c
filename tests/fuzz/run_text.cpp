// SPDX-License-Identifier: Apache-2.0
// run_text.cpp - what a recording says of its run: the text in its head, and changes of settings.
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/run/recorded_run.h"
#include "tests/fuzz/targets.h"

namespace h6::fuzz {
namespace {

void check_numbers(const io::RecordedRun& run) {
  const auto finite = [](const auto&... x) { return (std::isfinite(x) && ...); };
  const auto vec = [&](const h6Vec3& v) { return finite(v.x, v.y, v.z); };
  bool good = vec(run.gravity) && finite(run.frame_budget_us);
  for (const h6BodyDef& b : run.bodies) {
    good = good && vec(b.pose.p) && finite(b.pose.q.w, b.pose.q.x, b.pose.q.y, b.pose.q.z);
    good = good && vec(b.velocity.linear) && vec(b.velocity.angular) && vec(b.com);
    good = good && finite(b.mass);
    for (const double x : b.inertia) good = good && finite(x);
    promise(b.shell == -1 && b.field == -1, "a recorded body has no shell and no field yet");
  }
  for (const h6DeviceCapabilities& c : run.ratings)
    good = good && finite(c.max_force, c.max_torque, c.max_force_rate, c.max_torque_rate) &&
           finite(c.max_velocity, c.rate, c.freeze_time) && vec(c.workspace_min) &&
           vec(c.workspace_max);
  promise(good, "every number of a run is finite");
}

void check_run(std::string_view bytes, std::size_t hands) {
  io::RecordingHead head;
  head.run_json = bytes;
  head.hands = hands;
  const auto run = io::recorded_run(head);
  if (!run) return check_sentence(run.error());
  promise(run->ratings.size() == hands, "each hand has a rating");
  const auto text = nlohmann::json::parse(bytes);
  promise(text["threads"] == run->threads && text["max_contacts"] == run->max_contacts,
          "whole numbers are read as they stand");
  check_numbers(*run);
  head.run_json = io::run_text(*run);
  const auto again = io::recorded_run(head);
  promise(again && io::run_text(*again) == head.run_json, "a run is written as it was read");
}

void check_settings(const std::string& text) {
  const h6ContactDef contact = h6DefaultContactDef();
  const h6CouplingDef coupling = h6DefaultCouplingDef();
  const std::string before = io::settings_text(contact, coupling);
  h6ContactDef to = contact;
  h6CouplingDef held = coupling;
  if (const Outcome taken = io::take_settings(text, to, held); !taken) {
    check_sentence(taken.error());
    promise(io::settings_text(to, held) == before, "what is refused changes nothing");
    return;
  }
  for (const double x :
       {to.stiffness, to.epsilon, to.epsilon_normal, to.epsilon_torque, held.stiffness,
        held.rotational_stiffness, held.max_depth_voxels, held.max_force, held.max_torque})
    promise(std::isfinite(x), "every setting is finite");
  const std::string after = io::settings_text(to, held);
  h6ContactDef again = contact;
  h6CouplingDef held_again = coupling;
  promise(bool(io::take_settings(after, again, held_again)) &&
              io::settings_text(again, held_again) == after,
          "settings are written as they were read");
}

}  // namespace

void take_run_text(std::string_view bytes) {
  for (const std::size_t hands : {1, 2}) check_run(bytes, hands);
  check_settings(std::string(bytes));
}

}  // namespace h6::fuzz
