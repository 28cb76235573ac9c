// SPDX-License-Identifier: Apache-2.0
// run_scene.cpp - runs a scene in the haptic loop, from its first frame to its summary.
#include "io/run/run_scene.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "io/file/free_memory.h"
#include "io/file/write_aside.h"
#include "io/mesh/mesh_file.h"
#include "io/run/run_observer.h"
#include "io/run/run_setup.h"
#include "io/run/run_watch.h"
#include "io/run/steal_clock.h"
#include "io/view/trace.h"

namespace h6::cli {
namespace {

struct LoopDeleter {
  void operator()(h6Loop* l) const { h6DestroyLoop(l); }
};

constexpr double kTraceSeconds = 10;

Outcome open_session(const RunOptions& options, RunSetup& run) {
  h6SessionDef& def = run.def;
  if (!options.method.empty())
    h6MethodFromName(options.method.c_str(), &def.contact.method, &def.contact.pieces);
  def.threads = options.threads;
  def.frame_budget_us = options.budget_us;
  if (!options.device.empty())
    for (io::SceneHand& hand : run.hands) hand.device = options.device;
  run.record = options.record;
  run.virtual_time = options.virtual_time;
  if (options.observer) options.observer->prepare(run);
  if (Outcome opened = run.open(); !opened) return opened;
  if (options.virtual_time && !run.devices.real_time.empty())
    return Failure{"the device '" + run.devices.real_time +
                   "' lives in real time: leave out --virtual-time"};
  if (options.rearm > 0 && !run.devices.real_time.empty())
    return Failure{"only a person arms the device '" + run.devices.real_time +
                   "' again, who sees what it does: leave out --rearm"};
  return Done{};
}

// Says what overlaps at the start, and writes the points if they are wanted.
Outcome tell_overlaps(const RunSetup& run, const RunOptions& options, const Console& console,
                      RunSummary& summary) {
  summary.overlaps = run.overlaps;
  for (const PartOverlap& overlap : run.overlaps) console.log(overlap.sentence);
  return options.overlap.empty()
             ? Outcome(Done{})
             : io::write_text_aside(options.overlap, overlap_csv(run.loaded, run.session.get()));
}

// As many records as 10 s have, so that a writer that a loaded machine starves loses none, within a
// 16th of the free memory. Of a minute more the inputs are kept: 14 MB a hand.
std::size_t ring_frames(double rate) {
  const double free = static_cast<double>(io::free_memory().value_or(UINT64_MAX));
  const double most = free / 16 / sizeof(h6FrameRecord);
  return static_cast<std::size_t>(std::max(4096.0, std::min(10 * rate, most)));
}

// This thread writes the recording. Above normal programs, it is not starved by them; below the
// haptic thread it remains. Where the system refuses, it goes on as it is.
void rise_above_load() { (void)setpriority(PRIO_PROCESS, 0, -15); }

h6LoopDef loop_def(const RunOptions& options, const io::LoadedScene& loaded) {
  h6LoopDef def = h6DefaultLoopDef();
  def.duration = options.duration > 0 ? options.duration : loaded.duration();
  def.virtual_time = options.virtual_time;
  def.spin_us = options.spin_us;
  // In virtual time the loop waits for its reader.
  def.ring_frames = options.virtual_time ? 4096 : ring_frames(loaded.session_def().rate);
  def.ring_inputs = options.virtual_time ? 0 : 6 * def.ring_frames;
  def.view_contacts = options.view_contacts;
  return def;
}

// A run in progress. It passes rows from the loop to the watch, the observer and the trace.
class LiveRun {
 public:
  LiveRun(RunSetup& run, const RunOptions& options, RunSummary& summary, const Console& console)
      : run_(run),
        options_(options),
        summary_(summary),
        console_(console),
        watch_(run.loaded, run.def.rate, summary, run.recorder.get()),
        trace_(static_cast<std::size_t>(kTraceSeconds * run.def.rate)),
        progress_(options.observer ? io::Progress{} : console.progress()),
        bends_(rows_.size() * io::modes_of(recorded_bends(run.loaded))) {}

  Outcome start(const h6LoopDef& def) {
    if (!options_.virtual_time) rise_above_load();
    summary_.host_stole_ms = host_stole_ms(-1);
    h6Error error{};
    loop_.reset(h6StartLoop(run_.session.get(), run_.devices.devices.data(), &def, &error));
    if (!loop_) return Failure{error.message};
    // The signal handler stops the devices at once; the loop ends after its current frame.
    set_signal_hook([](void* context) { h6HaltLoop(static_cast<h6Loop*>(context)); }, loop_.get());
    if (interrupted.load()) h6RequestStop(loop_.get());
    if (options_.observer)
      options_.observer->begin(run_, loop_.get(),
                               [this](const std::string& what, const std::string& detail) {
                                 watch_.note(what, detail);
                               });
    return Done{};
  }

  Outcome follow() {
    while (h6LoopRunning(loop_.get())) {
      drain();
      if (options_.observer && !options_.observer->turn()) h6RequestStop(loop_.get());
      const int turn = options_.virtual_time ? 1 : 5;
      std::this_thread::sleep_for(std::chrono::milliseconds(turn));
      // Turns are counted, not time: a program that was stopped goes on after it.
      silent_ += 1e-3 * turn;
      if (options_.observer && options_.observer->paused() && !interrupted.load()) silent_ = 0;
      if (silent_ > kDriverSilence) give_up();
    }
    h6JoinLoop(loop_.get(), &summary_.loop);
    set_signal_hook(nullptr, nullptr);
    drain();
    if (summary_.host_stole_ms >= 0)
      summary_.host_stole_ms = host_stole_ms(-1) - summary_.host_stole_ms;
    if (progress_) progress_("running", 1);
    if (options_.observer) options_.observer->end();
    return recorded_;
  }

  // Writes the trace and ends the recording with the summary.
  Outcome finish() {
    watch_.finish(progress_);
    if (run_.def.hand_count == 0) follow_first_moving_body();
    if (!options_.trace.empty())
      if (Outcome written = trace_.write(options_.trace); !written) return written;
    if (!run_.recorder) return Done{};
    return run_.recorder->finish(
        Console::text(to_json(summary_, run_.loaded, options_.virtual_time)));
  }

 private:
  void drain() {
    while (std::size_t n =
               h6ReadRecordsWithBends(loop_.get(), rows_.data(), bends_.data(), rows_.size())) {
      silent_ = 0;
      if (recorded_) recorded_ = watch_.rows(rows_.data(), bends_.data(), n);
      n = keep_whole(n);
      if (n == 0) continue;
      if (options_.observer) options_.observer->rows(rows_.data(), n);
      if (!options_.trace.empty()) trace_.add(rows_.data(), n);
      if (progress_)
        progress_("running " + run_.loaded.scene.name, rows_[n - 1].time / summary_.seconds);
      if (options_.rearm > 0) arm_again(rows_[n - 1]);
    }
    if (recorded_ && run_.recorder)
      recorded_ = run_.recorder->frames(nullptr, 0);  // writes rows that are old enough to disk
    if (!recorded_) h6RequestStop(loop_.get());
  }

  // Leaves out rows that have nothing to show. Returns how many remain.
  std::size_t keep_whole(std::size_t count) {
    const auto end = rows_.begin() + static_cast<std::ptrdiff_t>(count);
    const auto kept = std::remove_if(rows_.begin(), end,
                                     [](const h6FrameRecord& r) { return r.inputs_only != 0; });
    return static_cast<std::size_t>(kept - rows_.begin());
  }

  // Nothing happens while the device is not well, so it is asked again after as long.
  void arm_again(const h6FrameRecord& newest) {
    if (!(newest.report.status & H6_OUTPUT_FAULT))
      faulty_since_ = -1;
    else if (faulty_since_ < 0)
      faulty_since_ = newest.time;
    if (faulty_since_ < 0 || newest.time - faulty_since_ < options_.rearm) return;
    faulty_since_ = newest.time;
    watch_.note("armed again", "as --rearm asks");
    h6ArmLoop(loop_.get());
  }

  // The haptic thread hangs in a device. Nothing can end it, so the process ends, after the
  // recording.
  [[noreturn]] void give_up() {
    set_signal_hook(nullptr, nullptr);
    run_.recorder.reset();
    std::string names;
    for (const h6Device& device : run_.devices.devices)
      names += (names.empty() ? "'" : ", '") + std::string(device.capabilities.name) + "'";
    end_without_driver(console_, names);
  }

  // Without a hand, the rows hold no body.
  void follow_first_moving_body() {
    for (std::size_t b = 0; b < run_.def.body_count; ++b)
      if (!run_.def.bodies[b].fixed) {
        summary_.final_pose = summary_.hand_pose =
            h6GetBody(run_.session.get(), static_cast<int32_t>(b)).pose;
        return;
      }
  }

  RunSetup& run_;
  const RunOptions& options_;
  RunSummary& summary_;
  const Console& console_;
  RunWatch watch_;
  io::view::Trace trace_;
  io::Progress progress_;
  std::vector<h6FrameRecord> rows_ = std::vector<h6FrameRecord>(256);
  std::vector<double> bends_;  // (rows x modes) q
  double silent_ = 0;          // [s] since the last row
  double faulty_since_ = -1;   // time of a row [s]; negative: no hand is faulty
  Outcome recorded_ = Done{};  // after a failure the run ends and no more rows are watched
  std::unique_ptr<h6Loop, LoopDeleter> loop_;
};

// Relief covers the places where a part starts, and none that are tighter on its way.
void advise_play(const io::LoadedScene& loaded, RunSummary& summary) {
  if (summary.left_behind.empty() || summary.overlaps.empty()) return;
  double most = 0;
  for (const PartOverlap& o : summary.overlaps) most = std::max(most, o.depth);
  char text[200];
  std::snprintf(text, sizeof text,
                "; it overlapped by up to %.3g %s at the start, and its way may be as tight: "
                "\"fit_offset\" gives all points play",
                most / io::metres(loaded.scene.unit), io::unit_name(loaded.scene.unit));
  summary.left_behind += text;
}

}  // namespace

Outcome check_options(const RunOptions& options) {
  h6Method method;
  std::uint32_t pieces;
  if (!options.method.empty() && h6MethodFromName(options.method.c_str(), &method, &pieces) != 0)
    return Failure{
        "no method is called '" + options.method +
        "': none, global, cluster, gauss3, gauss6, robust, series or firm, the Gauss ones also "
        "with +facing, +depth, +product, +cluster, +geodesic, +handles, +printed"};
  return options.device.empty() ? Outcome(Done{}) : check_device(options.device);
}

Result<RunSummary> run_scene(const io::LoadedScene& loaded, const RunOptions& options,
                             const Console& console) {
  if (Outcome known = check_options(options); !known) return known.failure();
  RunSetup run(loaded);
  if (Outcome opened = open_session(options, run); !opened) return opened.failure();

  h6LoopDef def = loop_def(options, loaded);
  RunSummary summary;
  summary.method = options.method.empty() ? h6MethodName(run.def.contact.method) : options.method;
  summary.recording = options.record;
  summary.seconds = def.duration;
  summary.virtual_time = options.virtual_time;
  if (Outcome told = tell_overlaps(run, options, console, summary); !told) return told.failure();
  const bool endless = options.observer && options.duration <= 0;  // the observer ends it
  if (endless) def.duration = 0;

  LiveRun live(run, options, summary, console);
  if (Outcome started = live.start(def); !started) return started.failure();
  if (Outcome followed = live.follow(); !followed) return followed.failure();
  summary.interrupted =
      !endless && interrupted.load() &&
      static_cast<double>(summary.loop.frames) < summary.seconds * run.def.rate - 0.5;
  if (Outcome finished = live.finish(); !finished) return finished.failure();
  advise_play(loaded, summary);
  return summary;
}

}  // namespace h6::cli
