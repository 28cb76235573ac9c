// SPDX-License-Identifier: Apache-2.0
// session.h - the state that changes from frame to frame, in storage that is sized once.
#pragma once
#include <atomic>
#include <span>

#include "hapsix/batch.h"
#include "hapsix/hapsix.h"
#include "runtime/contact/anytime.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"
#include "runtime/frame/near_pairs.h"
#include "runtime/frame/shell_lanes.h"
#include "runtime/frame/start_overlap.h"
#include "runtime/frame/substeps.h"
#include "runtime/model/model.h"
#include "runtime/motion/hand.h"
#include "runtime/motion/motion_stages.h"
#include "sched/clock.h"
#include "sched/frame_team.h"

namespace h6 {
// Who runs frames of a session. `workers`: nobody now, and no others may.
enum class Owner { nobody, workers, step, loop };
}  // namespace h6

struct h6Session {
  const h6Model* model = nullptr;
  std::atomic<h6::Owner> owner{h6::Owner::nobody};
  // Requests of other threads while a loop runs it: bit n asks for a fault of cause n, the last bit
  // is kAskDisarm.
  std::atomic<std::uint32_t> asked{0};
  h6Workers* workers = nullptr;  // whose scratch it borrows; null: it has its own
  h6Allocator allocator{};
  h6::Settings settings;

  std::span<h6::Body> bodies;
  std::span<h6::LinearWrench> acting;  // (bodies) the wrench on each that may move, in this frame
  std::span<h6::ShellBody> shells;     // by body
  h6::NearPairs near;
  std::span<h6::BetweenBodies> between;     // (rows of near pairs), or none where one body moves
  std::span<h6::BetweenFields> of_fields;   // (rows of near pairs), or none without `series`
  std::span<h6::FrictionSpring> frictions;  // (rows of near pairs), or none without friction
  std::span<h6::Deformation> bends;         // by body; of the bodies that bend
  std::span<h6::Hand> hands;
  std::span<h6::HandDevice> devices;  // (hands)
  std::span<h6::Island> islands;

  h6::Substeps substeps;
  h6::Anytime anytime;
  h6::Lanes lanes;
  h6FrameReport report{};
  std::uint64_t frame = 0;
  std::uint64_t still_hash = 0;  // of the bodies that never moved
  bool still_hashed = false;
  h6::sched::TickLength tick_length;
  std::int64_t left_at = 0;  // when the last frame ended, by the clock [ns]
  h6::sched::FrameTeam* team = nullptr;
  h6::sched::FrameTeam* alone = nullptr;  // a team of one, for lanes side by side
  h6::StartOverlap overlap;
  void* memory = nullptr;
  std::size_t memory_bytes = 0;
};

namespace h6 {

// Who owns the session while nobody steps it.
inline Owner idle_owner(const h6Session& s) { return s.workers ? Owner::workers : Owner::nobody; }
inline bool run_by_loop(const h6Session& s) { return s.owner.load() == Owner::loop; }

inline constexpr std::uint32_t kAskDisarm = 1u << 31;
static_assert(H6_CAUSE_COUNT < 31);

// For the thread that steps the session. take_asked carries out the requests of other threads.
void fault_all(h6Session& s, h6Cause cause);
void disarm_all(h6Session& s);
void take_asked(h6Session& s);

// The shell body with this body's index, or null.
inline ShellBody* find_shell(const h6Session& s, std::int32_t body) {
  const std::int32_t row = s.bodies[static_cast<std::size_t>(body)].meets;
  return row >= 0 ? &s.shells[static_cast<std::size_t>(row)] : nullptr;
}

// Lets go of the friction springs of every pair with this body.
void forget_friction(h6Session& s, std::int32_t body);

std::uint64_t state_hash(h6Session& s, const h6DeviceSample* samples);
h6Status frame(h6Session& s, const h6DeviceSample* samples, h6DeviceCommand* commands);

}  // namespace h6
