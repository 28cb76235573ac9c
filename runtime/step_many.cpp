// SPDX-License-Identifier: Apache-2.0
// step_many.cpp - the sessions of a call are the slices of one job: the calling thread takes them
// from the front and helpers from the end, so from call to call each finds its sessions in its own
// cache.
#include <algorithm>
#include <atomic>
#include <exception>
#include <iterator>

#include "hapsix/batch.h"
#include "runtime/frame/session.h"
#include "runtime/frame/workers.h"
#include "sched/clock.h"
#include "sched/frame_team.h"
#include "sched/parallel_for.h"

namespace h6 {
namespace {

bool whole(const h6StepArrays& a) {
  const auto unknown = [](std::uint64_t word) { return word != 0; };
  constexpr std::size_t most = SIZE_MAX / sizeof(h6Session*);  // that an array can hold
  return (a.sessions || a.count == 0) && a.count <= most && a.hands <= H6_MAX_HANDS &&
         a.steps > 0 && (a.pose || a.hands == 0 || a.count == 0) &&
         std::none_of(std::begin(a.reserved), std::end(a.reserved), unknown);
}

void put_in(const h6StepArrays& a, std::size_t first, h6DeviceSample* samples) {
  for (std::uint32_t h = 0; h < a.hands; ++h) {
    const std::size_t row = first + h;
    samples[h].pose = a.pose[row];
    if (a.velocity) samples[h].velocity = a.velocity[row];
    if (a.wrench) samples[h].wrench = a.wrench[row];
    if (a.buttons) samples[h].buttons = a.buttons[row];
  }
}

template <class T>
void put(T* column, std::size_t row, const T& value) {
  if (column) column[row] = value;
}

void put_out(const h6StepArrays& a, std::size_t i, std::uint32_t hand,
             const h6DeviceCommand& command, const h6BodyState& body) {
  const std::size_t row = a.hands * i + hand;
  put(a.command, row, command.wrench);
  put(a.command_pose, row, command.pose);
  put(a.causes, row, command.causes);
  put(a.body, row, body);
}

void put_out(const h6StepArrays& a, std::size_t i, h6Status status, const h6FrameReport& report) {
  put(a.status, i, status);
  put(a.contacts, i, report.contacts);
  put(a.max_depth, i, report.max_depth);
  put(a.max_depth_voxels, i, report.max_depth_voxels);
  put(a.state_hash, i, report.state_hash);
}

bool taken(h6Workers* workers, h6Session* session, std::uint32_t hands) {
  if (!session || session->hands.size() != hands) return false;
  if (session->workers && session->workers != workers) return false;
  Owner idle = idle_owner(*session);
  return session->owner.compare_exchange_strong(idle, Owner::step);
}

// `thread`: of the workers.
h6Status step_one(h6Workers* workers, unsigned thread, const h6StepArrays& a, std::size_t i) {
  h6Session* const session = a.sessions[i];
  if (!taken(workers, session, a.hands)) {
    for (std::uint32_t h = 0; h < a.hands; ++h) put_out(a, i, h, {}, {});
    put_out(a, i, H6_OUTPUT_FAULT, {});
    return H6_OUTPUT_FAULT;
  }
  h6DeviceSample samples[H6_MAX_HANDS]{};
  h6DeviceCommand commands[H6_MAX_HANDS];
  put_in(a, a.hands * i, samples);
  if (session->workers) borrow(session->lanes, workers->scratch[thread]);
  h6Status status = 0;
  for (std::uint32_t step = 0; step < a.steps; ++step) status |= frame(*session, samples, commands);
  for (std::uint32_t h = 0; h < a.hands; ++h)
    put_out(a, i, h, commands[h], h6GetBody(session, session->hands[h].body));
  put_out(a, i, status, session->report);
  session->owner.store(idle_owner(*session), std::memory_order_release);
  return status;
}

// A session has scratch for the threads of its own team, so every worker is the first thread there.
h6Status step_some(h6Workers* workers, const h6StepArrays& a, std::size_t begin, std::size_t end) {
  const unsigned before = sched::FrameTeam::here();
  sched::FrameTeam::be(0);
  h6Status status = 0;
  for (std::size_t i = begin; i < end; ++i) status |= step_one(workers, before, a, i);
  sched::FrameTeam::be(before);
  return status;
}

h6Status step_all(h6Workers& workers, const h6StepArrays& a) {
  sched::FrameTeam& team = workers.team;
  std::atomic<h6Status> status{0};
  // One session a slice; more only where there are more sessions than a job can have slices.
  constexpr std::size_t most = sched::FrameTeam::kMaxSlices - 1;
  const std::size_t each = (a.count + most - 1) / most;
  const unsigned before = sched::FrameTeam::here();
  sched::FrameTeam::be(0);  // the caller may be a helper of another team
  team.begin_frame(sched::now_ns());
  team.for_slices((a.count + each - 1) / each, [&](std::size_t slice) {
    const std::size_t begin = each * slice;
    status.fetch_or(step_some(&workers, a, begin, std::min(begin + each, a.count)));
  });
  team.end_frame(sched::now_ns());
  sched::FrameTeam::be(before);
  return status;
}

}  // namespace

bool make_room(h6Workers& workers, const ScratchRoom& room, h6Error* error) {
  const ScratchRoom next = either(workers.room, room);
  sched::HostVector<Scratch> scratch(workers.scratch.size());
  const auto lay_out = [&](Arena& arena) {
    for (Scratch& one : scratch) lay_out_scratch(one, arena, next, true);
    return arena.used();
  };
  if (workers.memory && next == workers.room) return true;
  Arena count;
  const std::size_t bytes = lay_out(count);
  void* const memory = allocate(workers.allocator, bytes);
  if (!memory)
    return fail(error, H6_ERROR_MEMORY,
                "no memory for the scratch of the workers (%zu MB): lower max_contacts",
                bytes / 1000000);
  std::fill_n(static_cast<char*>(memory), bytes, char{0});  // no page faults later
  Arena arena(memory, bytes);
  lay_out(arena);
  release(workers.allocator, workers.memory, workers.memory_bytes);
  workers.memory = memory, workers.memory_bytes = bytes, workers.room = next;
  std::copy(scratch.begin(), scratch.end(), workers.scratch.begin());  // sessions point to these
  return true;
}

}  // namespace h6

using namespace h6;

extern "C" {

h6WorkersDef h6DefaultWorkersDef(void) { return {}; }

h6StepArrays h6DefaultStepArrays(void) {
  h6StepArrays arrays{};
  arrays.hands = arrays.steps = 1;
  return arrays;
}

h6Workers* h6CreateWorkers(const h6WorkersDef* def, h6Error* error) {
  const h6WorkersDef used = def ? *def : h6DefaultWorkersDef();
  if (!check_reserved(used, "workers ", error)) return nullptr;
  if (used.threads > sched::FrameTeam::kMostThreads)
    return fail(error, H6_ERROR_RANGE, "workers threads is %u: 1 to %u, or 0 for one a core",
                used.threads, sched::FrameTeam::kMostThreads),
           nullptr;
  const unsigned threads = used.threads
                               ? used.threads
                               : std::min(sched::machine_threads(), sched::FrameTeam::kMostThreads);
  const sched::HostScope scope(used.allocator);
  try {
    h6Workers* const workers = create<h6Workers>(used.allocator, threads, used);
    if (!workers) fail(error, H6_ERROR_MEMORY, "no memory for workers");
    return workers;
  } catch (const std::bad_alloc&) {
    return fail(error, H6_ERROR_MEMORY, "no memory for workers"), nullptr;
  } catch (const std::exception& e) {  // from threads
    return fail(error, H6_ERROR_SYSTEM, "the workers could not be made: %s", e.what()), nullptr;
  }
}

void h6DestroyWorkers(h6Workers* workers) {
  if (workers) destroy(h6Allocator(workers->allocator), workers);
}

uint32_t h6WorkerThreads(const h6Workers* workers) { return workers ? workers->team.threads() : 0; }

h6Status h6StepMany(h6Workers* workers, const h6StepArrays* arrays) {
  if (!arrays || !whole(*arrays)) return H6_OUTPUT_FAULT;
  if (arrays->count == 0) return 0;
  if (!workers) return step_some(nullptr, *arrays, 0, arrays->count);
  const Turn turn(workers);
  if (!turn) return H6_OUTPUT_FAULT;
  return step_all(*workers, *arrays);
}

}  // extern "C"
