// SPDX-License-Identifier: Apache-2.0
// haptic_loop.cpp - the haptic thread: devices, session and clock together.
//
//   deadline -> requests of other threads -> read every device -> frame -> write every device,
//   unless they were stopped -> sign of life to the watchdog -> record into the ring
//
// Between two frames the loop hands poses and contacts to a viewer, and takes another session when
// one is offered: runtime/loop/loop_view.h.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <optional>

#include "runtime/frame/session.h"
#include "runtime/loop/device_gate.h"
#include "runtime/loop/loop_view.h"
#include "runtime/loop/record_ring.h"
#include "runtime/settings/engine_settings.h"
#include "sched/clock.h"
#include "sched/halt_list.h"
#include "sched/host_memory.h"
#include "sched/periodic_thread.h"
#include "sched/watchdog.h"

namespace {
enum Request { kNothing, kArm, kDisarm };
}

struct h6Loop {
  h6Session* session = nullptr;
  h6::SessionKind kind;     // of all its sessions
  h6Allocator allocator{};  // of the session that the loop began with
  h6LoopDef def{};
  h6Device devices[H6_MAX_HANDS] = {};
  h6DeviceSample samples[H6_MAX_HANDS] = {};
  h6DeviceCommand commands[H6_MAX_HANDS] = {};
  std::uint64_t frames = 0;  // how many to run; 0: no end
  std::uint64_t begun = 0;   // frames so far
  double due = 1;            // the next frame runs when this reaches 1
  std::optional<h6::RecordRing> ring;
  h6FrameRecord record{};
  h6::sched::HostVector<double> bends;  // q of the bodies that bend, after the frame
  h6LoopReport report{};                // belongs to the haptic thread until that has ended
  std::atomic<bool> stop{false};
  std::atomic<int> request{kNothing};
  h6::DeviceGate gate;
  std::int64_t sent_at = 0;                     // time of the last commands, 0: none yet [ns]
  std::int64_t read_at = 0;                     // ... and samples
  std::uint64_t trips = 0;                      // trips of the watchdog that were handled
  bool stepped = false;                         // this tick was a frame
  bool joined = false;                          // the session may be another loop's now
  std::optional<h6::sched::Watchdog> watchdog;  // uses the gate, so it is destroyed before it
  std::atomic<double> pace{1};
  std::optional<h6::LoopView> view;
  std::uint64_t view_step = 1;  // the viewer gets one of so many frames
  // The next session, and the previous one on its way back.
  std::atomic<h6Session*> offered{nullptr}, given_back{nullptr};
  std::atomic<bool> changing{false};  // by one caller of h6ChangeSession; the frame never looks
  // The haptic thread's core, which the helper avoids, and the helper's priority (0: none).
  std::atomic<int> core{-1}, helper_priority{0};
  std::optional<h6::sched::PeriodicThread> thread;
};

namespace h6 {
namespace {

constexpr double kViewRate = 125;  // most frames a viewer gets [Hz]

// The device is armed before its output. Otherwise the output would rise behind a device that still
// refuses it.
void arm_hands(h6Loop& loop) {
  h6Session& s = *loop.session;
  for (std::size_t h = 0; h < s.hands.size(); ++h) {
    const h6Device& device = loop.devices[h];
    OutputGuard& guard = s.devices[h].guard;
    if (guard.can_arm() && (!device.arm || device.arm(device.self) == 0)) guard.arm();
  }
}

// A session begins armed, and so do its devices; a latched fault stays.
void begin_output(h6Loop& loop) {
  h6Session& s = *loop.session;
  for (std::size_t h = 0; h < s.hands.size(); ++h) {
    const h6Device& device = loop.devices[h];
    OutputGuard& guard = s.devices[h].guard;
    guard.restart();
    if (loop.def.disarmed || guard.fault() != H6_CAUSE_NONE) continue;
    if (!device.arm || device.arm(device.self) == 0) guard.arm();
  }
  if (loop.watchdog) loop.watchdog->beat(sched::now_ns());
}

void end_output(h6Loop& loop) {
  loop.gate.stop_all();
  if (loop.watchdog) loop.watchdog->rest();
}

// Handles requests and faults of other threads since the last frame. Faults come after a request to
// arm, because its caller could not know of them.
void take_requests(h6Loop& loop) {
  const int request = loop.request.exchange(kNothing);
  if (request == kArm) arm_hands(loop);
  if (request == kDisarm) disarm_all(*loop.session);
  if (loop.watchdog && loop.watchdog->trips() != loop.trips) {
    loop.trips = loop.watchdog->trips();
    fault_all(*loop.session, H6_CAUSE_WATCHDOG);
  }
  if (loop.gate.halted()) fault_all(*loop.session, H6_CAUSE_STOPPED);
}

// A device that cannot be read or written is lost. All outputs go to zero and stay there.
void lose(h6Loop& loop, std::size_t hand) {
  loop.session->report.status |= H6_DEVICE_LOST;
  loop.session->devices[hand].lost = true;
  fault_all(*loop.session, H6_CAUSE_DEVICE_LOST);
}

void read_devices(h6Loop& loop, double time) {
  h6Session& s = *loop.session;
  for (std::size_t h = 0; h < s.hands.size(); ++h)
    if (loop.devices[h].read(loop.devices[h].self, time, &loop.samples[h]) != 0) lose(loop, h);
  if (loop.def.virtual_time || loop.sent_at == 0) return;
  // No command is late for a device that lives in the time of frames.
  const std::int64_t now = sched::now_ns(), before = loop.read_at;
  loop.read_at = now;
  const double since = 1e-9 * static_cast<double>(now - loop.sent_at),
               lasted = before == 0 ? 0 : 1e-9 * static_cast<double>(now - before);
  for (std::size_t h = 0; h < s.hands.size(); ++h)
    if (!loop.devices[h].capabilities.frame_time)
      note_interval(s.devices[h], s.settings.dt, since, lasted);
}

// Replaces commands that were computed before the devices were stopped.
void hold_back(h6Loop& loop, const h6DeviceCommand* before, h6Cause why) {
  for (std::size_t h = 0; h < loop.session->hands.size(); ++h) {
    h6DeviceCommand& command = loop.commands[h];
    command.wrench = {};
    command.velocity = {};
    // A motion stays at the last pose that was sent, or where the device is.
    const bool moves = loop.session->hands[h].mode != H6_IMPEDANCE;
    if (moves && loop.sent_at != 0) command.pose = before[h].pose;
    command.cause = why;
    command.causes |= 1u << why;
  }
}

bool tripped(const h6Loop& loop) { return loop.watchdog && loop.watchdog->trips() != loop.trips; }

// False: the devices were halted, and nothing may be sent any more.
bool write_devices(h6Loop& loop, double time, const h6DeviceCommand* before) {
  if (!loop.gate.enter()) {
    hold_back(loop, before, H6_CAUSE_STOPPED);
    return false;
  }
  if (tripped(loop)) hold_back(loop, before, H6_CAUSE_WATCHDOG);
  for (std::size_t h = 0; h < loop.session->hands.size(); ++h)
    if (loop.devices[h].write(loop.devices[h].self, time, &loop.commands[h]) != 0) lose(loop, h);
  if (tripped(loop)) loop.gate.stop_real();  // the watchdog tripped during the writes
  loop.sent_at = sched::now_ns();
  if (loop.watchdog) loop.watchdog->beat(loop.sent_at);
  return loop.gate.leave();
}

void change_session(h6Loop& loop) {
  if (!loop.offered.load(std::memory_order_relaxed)) return;
  h6Session* next = loop.offered.exchange(nullptr, std::memory_order_acquire);
  if (!next) return;  // the offer was withdrawn
  take_over(*next, *loop.session);
  next->asked.fetch_or(loop.session->asked.exchange(0));
  h6Session* const before = loop.session;
  loop.session = next;
  ++loop.record.settings;
  // The last word: from here on the session before is the caller's.
  loop.given_back.store(before, std::memory_order_release);
}

// Slow motion: a frame only every few periods. In the time of frames nothing changes.
bool frame_due(h6Loop& loop) {
  loop.due += loop.pace.load(std::memory_order_relaxed);
  if (loop.due < 1) return false;
  loop.due -= 1;
  if (loop.due >= 1) loop.due = 0;
  return true;
}

bool tick(h6Loop& loop, const sched::TickTiming& before, double wakeup_us) {
  change_session(loop);
  loop.stepped = frame_due(loop);
  if (!loop.stepped) return true;
  const std::uint64_t number = loop.begun++;
  h6Session& s = *loop.session;
  const double time = static_cast<double>(number) * s.settings.dt;
  h6DeviceCommand last[H6_MAX_HANDS];
  for (std::size_t h = 0; h < s.hands.size(); ++h) last[h] = loop.commands[h];
  take_requests(loop);
  read_devices(loop, time);
  take_asked(s);  // a device may ask in its read
  frame(s, loop.samples, loop.commands);
  const bool sent = write_devices(loop, time, last);
  if (before.late != sched::Late::no) s.report.status |= H6_LATE;
  loop.report.status |= s.report.status;
  loop.record.time = time;
  loop.record.wakeup_us = wakeup_us;
  return sent && (loop.frames == 0 || number + 1 < loop.frames);
}

std::uint32_t late_bit(sched::Late late) {
  switch (late) {
    case sched::Late::compute:
      return H6_LATE_COMPUTE;
    case sched::Late::stolen:
      return H6_LATE_STOLEN;
    case sched::Late::wakeup:
      return H6_LATE_WAKEUP;
    default:
      return 0;
  }
}

void count_late(h6LoopReport& report, const sched::TickTiming& timing) {
  h6LateHistogram* const by_cause[] = {nullptr, &report.late_us_compute, &report.late_us_stolen,
                                       &report.late_us_wakeup};
  h6LateHistogram* histogram = by_cause[static_cast<int>(timing.late)];
  if (!histogram) return;
  std::size_t bin = 0;
  for (double most = 10; bin + 1 < H6_LATE_BINS && timing.late_us >= most; most *= 10) ++bin;
  ++histogram->frames[bin];
}

// Runs after the frame and before the next deadline, outside the measured time.
void keep_record(h6Loop& loop, const sched::TickTiming& timing) {
  if (!loop.stepped) return;
  h6Session& s = *loop.session;
  h6LoopReport& r = loop.report;
  ++r.frames;
  r.late_compute += timing.late == sched::Late::compute;
  r.late_stolen += timing.late == sched::Late::stolen;
  r.late_wakeup += timing.late == sched::Late::wakeup;
  count_late(r, timing);
  r.coarse_frames += (s.report.status & H6_COARSE) != 0;
  if (timing.wakeup_us > r.wakeup_us_max) r.wakeup_us_max = timing.wakeup_us;
  if (loop.view && s.report.frame % loop.view_step == 0) loop.view->write(s, loop.record.time);
  if (!loop.ring) return;
  h6FrameRecord& row = loop.record;
  row.report = s.report;
  row.late = late_bit(timing.late);
  row.late_us = timing.late_us;
  row.cpu_us = timing.cpu_us;
  for (std::size_t h = 0; h < s.hands.size(); ++h) {
    row.hand[h] = loop.samples[h];
    row.command[h] = loop.commands[h];
    row.state[h] = s.devices[h].guard.state();
    row.safety_input[h] = s.devices[h].guard.input();
    const Body& body = s.bodies[s.hands[h].body];
    row.body[h] = {mesh_pose(body), {to(body.v), to(body.w)}};
  }
  // Virtual time has no deadline, so it waits for its reader and loses no rows.
  if (loop.def.virtual_time)
    while (loop.ring->full() && !loop.stop.load(std::memory_order_relaxed) && !loop.gate.halted())
      sched::sleep_until_ns(sched::now_ns() + 200000);
  double* to = loop.bends.data();
  for (const Deformation& d : s.bends) to = std::copy_n(d.q, d.modes, to);
  loop.ring->push(row, loop.bends.data());
}

// The longest waits of h6ChangeSession for its turn and then for a frame, each [ns].
constexpr std::int64_t kTakeOverTime = 2'000'000'000;
constexpr std::int64_t kPoll = 100'000;  // between two looks of its wait [ns]
constexpr const char* kLoopEnded = "the loop has ended";
constexpr int kHelperPriority = 79;  // below the haptic thread's

void note_grant(h6LoopReport& report, const sched::RealtimeGrant& grant) {
  std::snprintf(report.granted, sizeof report.granted, "%s", grant.text);
  h6Granted& g = report.grant;
  g.core = grant.core;
  g.fifo = grant.fifo;
  g.locked = grant.locked;
  g.isolated = grant.isolated;
  std::snprintf(g.governor, sizeof g.governor, "%s", grant.governor);
}

const char* mode_name(std::uint32_t mode) {
  if (mode == H6_ADMITTANCE) return "admittance";
  return mode == H6_PSEUDO_ADMITTANCE ? "pseudo-admittance" : "impedance";
}

// The shortest time in which a full output may decay to zero [s].
double shortest_decay(const h6Session& s) {
  double shortest = SafetyLimits{}.decay_time;
  for (std::size_t h = 0; h < s.hands.size(); ++h)
    shortest = std::min(shortest, s.devices[h].guard.limits().decay_time);
  return shortest;
}

// A device that names no modes is an impedance device.
bool speaks(const h6Device& device, std::uint32_t mode) {
  const std::uint32_t modes = device.capabilities.modes;
  return ((modes ? modes : std::uint32_t{H6_IMPEDANCE}) & mode) != 0;
}

constexpr const char* kOfWorkers =
    "the session was made for h6StepMany: its h6SessionDef.workers must be NULL for a loop";

bool check(const h6Session* session, const h6Device* devices, const h6LoopDef& def,
           h6Error* error) {
  if (!session) return fail(error, "a loop needs a session");
  if (session->workers) return fail(error, kOfWorkers);
  if (!session->hands.empty() && !devices)
    return fail(error, "a loop needs one device for each of %zu hands", session->hands.size());
  for (std::size_t h = 0; h < session->hands.size(); ++h) {
    if (!devices[h].read || !devices[h].write)
      return fail(error, "device %zu has no read or no write", h);
    if (!check_reserved(devices[h], "device: ", error) ||
        !check_reserved(devices[h].capabilities, "device: capabilities: ", error))
      return false;
  }
  for (std::size_t h = 0; h < session->hands.size(); ++h)
    if (!speaks(devices[h], session->hands[h].mode))
      return fail(error,
                  "hand %zu works in %s mode, which device %zu does not offer: choose another mode "
                  "for the hand or another device",
                  h, mode_name(session->hands[h].mode), h);
  for (std::size_t h = 0; h < session->hands.size(); ++h)
    if (const AboveRating above = above_rating(devices[h].capabilities, session->devices[h].safety);
        above.key)
      return fail(error,
                  "hand %zu: safety %s, %g %s, is above what device %zu is rated for, %g %s: leave "
                  "it out or choose less",
                  h, above.key, above.asked, above.unit, h, above.rating, above.unit);
  return check_reserved(def, "loop: ", error) && check_settings(loop_settings(), &def, "", error);
}

// The turn of one caller of h6ChangeSession. Only callers wait here, and no longer than
// kTakeOverTime, which std::mutex could not promise.
class ChangeTurn {
 public:
  explicit ChangeTurn(std::atomic<bool>& taken) : taken_(taken) {
    const std::int64_t give_up = sched::now_ns() + kTakeOverTime;
    while (taken_.exchange(true, std::memory_order_acquire)) {
      if (sched::now_ns() > give_up) return;
      sched::sleep_until_ns(sched::now_ns() + kPoll);
    }
    mine_ = true;
  }
  ~ChangeTurn() {
    if (mine_) taken_.store(false, std::memory_order_release);
  }
  ChangeTurn(const ChangeTurn&) = delete;
  ChangeTurn& operator=(const ChangeTurn&) = delete;
  bool mine() const { return mine_; }

 private:
  std::atomic<bool>& taken_;
  bool mine_ = false;
};

// Offers `next` to the haptic thread and waits for the session that it ran. Null: `next` was not
// taken, and `error` says why.
h6Session* exchange(h6Loop& loop, h6Session* next, h6Error* error) {
  const std::int64_t give_up = sched::now_ns() + kTakeOverTime;
  if (const int core = loop.core; core >= 0) next->team->set_realtime(loop.helper_priority, core);
  loop.offered.store(next, std::memory_order_release);
  while (true) {
    if (h6Session* before = loop.given_back.exchange(nullptr, std::memory_order_acquire))
      return before;
    if (!loop.thread->running() && loop.offered.exchange(nullptr))
      return fail(error, kLoopEnded), nullptr;
    // The loop may take the offer at this instant; then it gives the former session back soon.
    if (sched::now_ns() > give_up && loop.offered.exchange(nullptr))
      return fail(error, H6_ERROR_BUSY,
                  "no frame began for 2 s: a device's driver hangs, or nobody reads the records of "
                  "virtual time"),
             nullptr;
    sched::sleep_until_ns(sched::now_ns() + kPoll);
  }
}

}  // namespace
}  // namespace h6

using namespace h6;

extern "C" {

h6Loop* h6StartLoop(h6Session* session, const h6Device* devices, const h6LoopDef* def,
                    h6Error* error) {
  const h6LoopDef used = def ? *def : h6DefaultLoopDef();
  if (!check(session, devices, used, error)) return nullptr;
  Owner none = Owner::nobody;
  if (!session->owner.compare_exchange_strong(none, Owner::loop))
    return fail(error, H6_ERROR_BUSY, "another loop or step runs this session"), nullptr;
  const sched::HostScope scope(session->allocator);
  // If this call ends without a loop, the session is given back, last of all.
  const auto give_back = [](h6Session* s) { s->owner = Owner::nobody; };
  std::unique_ptr<h6Session, decltype(give_back)> held(session, give_back);
  try {
    const auto let_go = [](h6Loop* l) { destroy(h6Allocator(l->allocator), l); };
    std::unique_ptr<h6Loop, decltype(let_go)> loop(create<h6Loop>(session->allocator), let_go);
    if (!loop) throw std::bad_alloc();
    loop->session = session;
    loop->kind = kind_of(*session);
    loop->allocator = session->allocator;
    loop->def = used;
    for (std::size_t h = 0; h < session->hands.size(); ++h) {
      loop->devices[h] = devices[h];
      loop->samples[h].pose.q.w = 1;
      set_rating(session->devices[h], devices[h].capabilities);
    }
    session->anytime.no_clock = used.virtual_time;
    loop->report.grant.core = -1;
    loop->frames = static_cast<std::uint64_t>(used.duration / session->settings.dt + 0.5);
    if (used.duration > 0 && loop->frames == 0) loop->frames = 1;
    if (used.ring_frames) {
      std::size_t modes = 0;
      for (const Deformation& d : session->bends) modes += static_cast<std::size_t>(d.modes);
      loop->bends.resize(modes);
      loop->ring.emplace(used.ring_frames, used.ring_inputs, session->hands.size(), modes,
                         session->allocator);
      if (!loop->ring->ready()) {
        fail(error, H6_ERROR_MEMORY, "no memory for %zu records: lower ring_frames",
             used.ring_frames);
        return nullptr;
      }
    }
    if (used.view_contacts) {
      loop->view.emplace(*session, used.view_contacts);
      loop->view_step =
          static_cast<std::uint64_t>(std::max(1.0, 1 / (kViewRate * session->settings.dt)));
    }
    sched::PeriodicThreadOptions options;
    options.rate = 1 / session->settings.dt;
    options.spin_us = used.spin_us;
    options.virtual_time = used.virtual_time;
    options.realtime = used.realtime;
    options.request.core = used.core;
    bool real = false;
    for (std::size_t h = 0; h < session->hands.size(); ++h)
      real = real || !devices[h].capabilities.frame_time;
    if (!loop->gate.open(loop->devices, session->hands.size())) {
      fail(error, "more than %zu loops at a time: end one first", sched::kMostToHalt);
      return nullptr;
    }
    h6Loop* raw = loop.get();
    if (real && !used.virtual_time)
      loop->watchdog.emplace(
          static_cast<std::int64_t>(1e9 * (session->settings.dt + shortest_decay(*session))),
          used.realtime ? options.request.priority + 1 : 0, [raw] { raw->gate.stop_real(); });
    loop->thread.emplace(
        options,
        sched::PeriodicThread::Work{
            [raw](const sched::RealtimeGrant& grant) {
              note_grant(raw->report, grant);
              raw->helper_priority = grant.fifo ? kHelperPriority : 0;
              raw->core = grant.core;
              raw->session->team->set_realtime(raw->helper_priority, grant.core);
              begin_output(*raw);
            },
            [raw](std::uint64_t, const sched::TickTiming& before, double wakeup) {
              raw->stepped = false;
              const bool more =
                  !raw->stop.load(std::memory_order_relaxed) && tick(*raw, before, wakeup);
              if (!more) end_output(*raw);
              return more;
            },
            [raw](std::uint64_t, const sched::TickTiming& timing) { keep_record(*raw, timing); }});
    held.release();
    return loop.release();
  } catch (const std::bad_alloc&) {
    return fail(error, H6_ERROR_MEMORY, "no memory for a loop"), nullptr;
  } catch (const std::exception& e) {
    fail(error, H6_ERROR_SYSTEM, "the haptic thread could not be started: %s", e.what());
    return nullptr;
  }
}

size_t h6ReadRecords(h6Loop* loop, h6FrameRecord* out, size_t capacity) {
  return h6ReadRecordsWithBends(loop, out, nullptr, capacity);
}
size_t h6ReadRecordsWithBends(h6Loop* loop, h6FrameRecord* out, double* bends, size_t capacity) {
  return loop && out && loop->ring ? loop->ring->pop(out, bends, capacity) : 0;
}
bool h6ReadView(h6Loop* loop, h6LoopView* out) {
  return loop && out && loop->view && loop->view->read(out);
}

void h6SetPace(h6Loop* loop, double pace) {
  if (!loop) return;
  loop->pace.store(pace >= 0 && pace <= 1 ? pace : 1, std::memory_order_relaxed);
}

h6Session* h6ChangeSession(h6Loop* loop, h6Session* next, h6Error* error) {
  if (!loop) return fail(error, "no loop was given"), nullptr;
  if (loop->thread->is_this())
    return fail(error, H6_ERROR_BUSY, "the haptic thread cannot wait for its own next frame"),
           nullptr;
  const ChangeTurn turn(loop->changing);
  if (!turn.mine())
    return fail(
               error, H6_ERROR_BUSY,
               "no turn came for 2 s: other threads change this loop's session, or a driver hangs"),
           nullptr;
  // Another thread may join the loop at any time and destroy its session, which is not looked at.
  if (!loop->thread->running()) return fail(error, kLoopEnded), nullptr;
  if (next && next->workers) return fail(error, kOfWorkers), nullptr;
  Owner none = Owner::nobody;
  if (next && !next->owner.compare_exchange_strong(none, Owner::loop))
    return fail(error, H6_ERROR_BUSY, "another loop or step runs the next session"), nullptr;
  if (may_take_over(next, loop->kind, error))
    if (h6Session* const before = exchange(*loop, next, error)) {
      before->owner = Owner::nobody;
      return before;
    }
  if (next) next->owner = Owner::nobody;
  return nullptr;
}

bool h6LoopRunning(const h6Loop* loop) { return loop && loop->thread->running(); }
void h6RequestStop(h6Loop* loop) {
  if (loop) loop->stop.store(true, std::memory_order_relaxed);
}
void h6ArmLoop(h6Loop* loop) {
  if (loop) loop->request.store(kArm);
}
void h6DisarmLoop(h6Loop* loop) {
  if (loop) loop->request.store(kDisarm);
}
void h6HaltLoop(h6Loop* loop) {
  if (!loop) return;
  loop->gate.halt();
  h6RequestStop(loop);
}
void h6HaltAll(void) { sched::halt_all(); }

// Reports the hands when the haptic thread has ended: later the session may be another loop's.
static void report_hands(h6Loop& loop) {
  loop.report.fault = H6_CAUSE_NONE;
  for (std::size_t h = 0; h < loop.session->hands.size(); ++h) {
    OutputGuard& guard = loop.session->devices[h].guard;
    if (loop.gate.halted()) guard.fault(H6_CAUSE_STOPPED);
    loop.report.hand[h] = guard.report();
    if (loop.report.fault == H6_CAUSE_NONE) loop.report.fault = guard.fault();
  }
}

void h6JoinLoop(h6Loop* loop, h6LoopReport* out) {
  if (out) *out = {};
  if (!loop || loop->thread->is_this()) return;
  loop->thread->join();
  loop->gate.stop_all();
  if (!loop->joined) {
    take_asked(*loop->session);  // too late for a frame
    report_hands(*loop);
    loop->session->team->set_realtime(0, -1);
    loop->session->owner = Owner::nobody;
    loop->joined = true;
    h6Log(H6_LOG_NOTE, loop->report.granted);
    if (loop->watchdog && loop->watchdog->trips())
      h6Log(H6_LOG_WARNING, "the haptic thread stalled, so the watchdog stopped the devices");
    if (loop->ring && loop->ring->lost())
      h6Log(H6_LOG_WARNING, "records were lost to a slow reader: raise ring_frames");
  }
  h6LoopReport& report = loop->report;  // the haptic thread has ended
  report.ring_overruns = loop->ring ? loop->ring->lost() : 0;
  report.inputs_only = loop->ring ? loop->ring->inputs_only() : 0;
  report.watchdog_trips = loop->watchdog ? loop->watchdog->trips() : 0;
  if (out) *out = report;
}

void h6DestroyLoop(h6Loop* loop) {
  if (!loop) return;
  h6RequestStop(loop);
  if (loop->thread->is_this()) return;  // the thread still uses the loop
  h6JoinLoop(loop, nullptr);
  destroy(h6Allocator(loop->allocator), loop);
}

}  // extern "C"
