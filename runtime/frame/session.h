// SPDX-License-Identifier: Apache-2.0
// session.h - the state that changes from frame to frame, in storage that is sized once.
#pragma once
#include <span>

#include "hapsix/hapsix.h"
#include "runtime/contact/anytime.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"
#include "runtime/frame/shell_lanes.h"
#include "runtime/frame/start_overlap.h"
#include "runtime/frame/substeps.h"
#include "runtime/model/model.h"
#include "runtime/motion/hand.h"
#include "runtime/motion/motion_stages.h"
#include "sched/clock.h"
#include "sched/frame_team.h"

struct h6Session {
  const h6Model* model = nullptr;
  h6Allocator allocator{};
  h6::Settings settings;

  std::span<h6::Body> bodies;
  std::span<h6::LinearWrench> acting;  // (bodies) the wrench on each in this frame
  std::span<h6::Pair> pairs;           // the pairs of one shell body are neighbours
  std::span<h6::ShellBody> shells;
  std::span<h6::FrictionSpring> frictions;  // (pairs), or none without friction
  std::span<h6::Hand> hands;
  std::span<h6::HandDevice> devices;  // (hands)
  std::span<h6::Island> islands;

  h6::Substeps substeps;
  h6::Anytime anytime;
  h6::Lanes lanes;
  h6FrameReport report{};
  std::uint64_t frame = 0;
  h6::sched::TickLength tick_length;
  std::int64_t left_at = 0;  // when the last frame ended, by the clock [ns]
  h6::sched::FrameTeam* team = nullptr;
  h6::sched::FrameTeam* alone = nullptr;  // a team of one, for lanes side by side
  h6::StartOverlap overlap;
  void* memory = nullptr;
  std::size_t memory_bytes = 0;
};

namespace h6 {

// The shell body with this body's index, or null.
inline ShellBody* find_shell(const h6Session& s, std::int32_t body) {
  for (ShellBody& shell : s.shells)
    if (shell.body == body) return &shell;
  return nullptr;
}

// Lets go of the friction springs of every pair with this body.
void forget_friction(h6Session& s, std::int32_t body);

std::uint64_t state_hash(const h6Session& s, const h6DeviceSample* samples);
h6Status frame(h6Session& s, const h6DeviceSample* samples, h6DeviceCommand* commands);

}  // namespace h6
