// haptic_loop.cpp - devices, session and clock joined: what runs on the haptic thread.
//
//   deadline -> read every device -> frame -> write every device -> record into the ring
#include <atomic>
#include <cstdio>
#include <exception>
#include <memory>

#include "runtime/session.h"
#include "runtime/stages.h"
#include "sched/clock.h"
#include "sched/periodic_thread.h"
#include "sched/spsc_ring.h"

struct h6Loop {
  h6Session* session = nullptr;
  h6LoopDef def{};
  h6Device devices[H6_MAX_HANDS] = {};
  h6DeviceSample samples[H6_MAX_HANDS] = {};
  h6DeviceCommand commands[H6_MAX_HANDS] = {};
  std::uint64_t frames = 0;  // to run; 0: no end
  std::unique_ptr<h6::sched::SpscRing<h6FrameRecord>> ring;
  h6FrameRecord record{};
  h6LoopReport report{};  // the haptic thread's until it has ended
  std::atomic<bool> stop{false};
  std::unique_ptr<h6::sched::PeriodicThread> thread;
};

namespace h6 {
namespace {

void stop_devices(h6Loop& loop) {
  for (std::size_t h = 0; h < loop.session->hand_count; ++h)
    if (loop.devices[h].stop) loop.devices[h].stop(loop.devices[h].self);
}

// A device that cannot be read or written is lost: all outputs go to zero and stay there.
void lose(h6Loop& loop) {
  loop.session->report.status |= H6_DEVICE_LOST;
  h6Fault(loop.session, H6_CAUSE_DEVICE_LOST);
}

bool tick(h6Loop& loop, std::uint64_t number, const sched::TickTiming& before, double wakeup_us) {
  h6Session& s = *loop.session;
  const double time = static_cast<double>(number) * s.dt;
  bool lost = false;
  for (std::size_t h = 0; h < s.hand_count; ++h)
    lost = loop.devices[h].read(loop.devices[h].self, time, &loop.samples[h]) != 0 || lost;
  if (lost) h6Fault(&s, H6_CAUSE_DEVICE_LOST);
  frame(s, loop.samples, loop.commands);
  for (std::size_t h = 0; h < s.hand_count; ++h)
    if (loop.devices[h].write(loop.devices[h].self, time, &loop.commands[h]) != 0) lost = true;
  if (lost) lose(loop);
  if (before.late != sched::Late::no) s.report.status |= H6_LATE;
  loop.report.status |= s.report.status;
  loop.record.time = time;
  loop.record.wakeup_us = wakeup_us;
  return loop.frames == 0 || number + 1 < loop.frames;
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

// After the frame, before the next deadline: nothing here is timed as the frame's.
void keep_record(h6Loop& loop, const sched::TickTiming& timing) {
  h6Session& s = *loop.session;
  h6LoopReport& r = loop.report;
  ++r.frames;
  r.late_compute += timing.late == sched::Late::compute;
  r.late_stolen += timing.late == sched::Late::stolen;
  r.late_wakeup += timing.late == sched::Late::wakeup;
  count_late(r, timing);
  r.coarse_frames += (s.report.status & H6_COARSE) != 0;
  if (timing.wakeup_us > r.wakeup_us_max) r.wakeup_us_max = timing.wakeup_us;
  if (!loop.ring) return;
  h6FrameRecord& row = loop.record;
  row.report = s.report;
  row.late = late_bit(timing.late);
  row.late_us = timing.late_us;
  row.cpu_us = timing.cpu_us;
  for (std::size_t h = 0; h < s.hand_count; ++h) {
    row.hand[h] = loop.samples[h];
    row.command[h] = loop.commands[h];
    const Body& body = s.bodies[s.hands[h].body];
    row.body[h] = {mesh_pose(body), {to(body.v), to(body.w)}};
  }
  // Virtual time has no deadline: it waits for its reader instead of losing rows.
  if (loop.def.virtual_time)
    while (loop.ring->full() && !loop.stop.load(std::memory_order_relaxed))
      sched::sleep_until_ns(sched::now_ns() + 200000);
  loop.ring->push(row);
}

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

// A device that does not say is an impedance device.
bool speaks(const h6Device& device, std::uint32_t mode) {
  const std::uint32_t modes = device.capabilities.modes;
  return ((modes ? modes : std::uint32_t{H6_IMPEDANCE}) & mode) != 0;
}

bool check(const h6Session* session, const h6Device* devices, const h6LoopDef& def,
           h6Error* error) {
  if (!session) return fail(error, "a loop needs a session");
  if (session->hand_count && !devices)
    return fail(error, "a loop needs one device for each of %zu hands", session->hand_count);
  for (std::size_t h = 0; h < session->hand_count; ++h)
    if (!devices[h].read || !devices[h].write)
      return fail(error, "device %zu has no read or no write", h);
  for (std::size_t h = 0; h < session->hand_count; ++h)
    if (!speaks(devices[h], session->hands[h].mode))
      return fail(error,
                  "hand %zu works in %s mode, which device %zu does not offer: choose another mode "
                  "for the hand or another device",
                  h, mode_name(session->hands[h].mode), h);
  if (!(def.duration >= 0) || def.duration > 1e9)
    return fail(error, "duration must be 0 (no end) to 1e9 s, it is %g", def.duration);
  if (!(def.spin_us >= 0 && def.spin_us <= 1e4))
    return fail(error, "spin_us must be in 0..10000, it is %g", def.spin_us);
  if (def.ring_frames > 10000000)
    return fail(error, "ring_frames must be at most 10000000, it is %zu", def.ring_frames);
  return true;
}

}  // namespace
}  // namespace h6

using namespace h6;

extern "C" {

h6Loop* h6StartLoop(h6Session* session, const h6Device* devices, const h6LoopDef* def,
                    h6Error* error) {
  const h6LoopDef used = def ? *def : h6DefaultLoopDef();
  if (!check(session, devices, used, error)) return nullptr;
  try {
    auto loop = std::make_unique<h6Loop>();
    loop->session = session;
    loop->def = used;
    for (std::size_t h = 0; h < session->hand_count; ++h) {
      loop->devices[h] = devices[h];
      loop->samples[h].pose.q.w = 1;
      h6SetRating(session, static_cast<std::int32_t>(h), &devices[h].capabilities);
    }
    session->anytime.no_clock = used.virtual_time;
    loop->report.grant.core = -1;
    loop->frames = static_cast<std::uint64_t>(used.duration / session->dt + 0.5);
    if (used.duration > 0 && loop->frames == 0) loop->frames = 1;
    if (used.ring_frames)
      loop->ring = std::make_unique<sched::SpscRing<h6FrameRecord>>(used.ring_frames);
    sched::PeriodicThreadOptions options;
    options.rate = 1 / session->dt;
    options.spin_us = used.spin_us;
    options.virtual_time = used.virtual_time;
    options.realtime = used.realtime;
    options.request.core = used.core;
    h6Loop* raw = loop.get();
    loop->thread = std::make_unique<sched::PeriodicThread>(
        options,
        sched::PeriodicThread::Work{
            [raw](const sched::RealtimeGrant& grant) {
              note_grant(raw->report, grant);
              if (grant.fifo) raw->session->team->set_realtime(kHelperPriority, grant.core);
            },
            [raw](std::uint64_t n, const sched::TickTiming& before, double wakeup) {
              return !raw->stop.load(std::memory_order_relaxed) && tick(*raw, n, before, wakeup);
            },
            [raw](std::uint64_t, const sched::TickTiming& timing) { keep_record(*raw, timing); }});
    return loop.release();
  } catch (const std::exception& e) {
    fail(error, "the haptic thread could not be started: %s", e.what());
    return nullptr;
  }
}

size_t h6ReadRecords(h6Loop* loop, h6FrameRecord* out, size_t capacity) {
  return loop->ring ? loop->ring->pop(out, capacity) : 0;
}
bool h6LoopRunning(const h6Loop* loop) { return loop->thread->running(); }
void h6RequestStop(h6Loop* loop) { loop->stop.store(true, std::memory_order_relaxed); }

h6LoopReport h6JoinLoop(h6Loop* loop) {
  loop->thread->join();
  stop_devices(*loop);
  loop->session->team->set_realtime(0, -1);
  h6LoopReport report = loop->report;
  report.fault = H6_CAUSE_NONE;
  for (std::size_t h = 0; h < loop->session->hand_count; ++h)
    if (report.fault == H6_CAUSE_NONE) report.fault = loop->session->hands[h].guard.fault();
  report.ring_overruns = loop->ring ? loop->ring->dropped() : 0;
  return report;
}

void h6DestroyLoop(h6Loop* loop) {
  if (!loop) return;
  h6RequestStop(loop);
  h6JoinLoop(loop);
  delete loop;
}

}  // extern "C"
