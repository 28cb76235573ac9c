// SPDX-License-Identifier: Apache-2.0
#include "io/run/run_scene.h"

#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "hapsix/vector.h"
#include "io/run/run_observer.h"
#include "io/run/run_setup.h"
#include "io/view/trace.h"
#include "kernels/targets.h"

namespace h6::cli {
namespace {

using nlohmann::ordered_json;

struct LoopDeleter {
  void operator()(h6Loop* l) const { h6DestroyLoop(l); }
};

constexpr double kTraceSeconds = 10;

// Everything that is made of the stream of frames, one row at a time.
class Watcher {
 public:
  Watcher(const io::LoadedScene& loaded, RunSummary& summary, double duration,
          io::Recorder* recorder)
      : summary_(summary),
        recorder_(recorder),
        duration_(duration),
        hands_(loaded.hands.size()),
        com_(loaded.hands.empty()
                 ? h6Vec3{}
                 : loaded.bodies[static_cast<std::size_t>(loaded.hands[0].body)].com),
        verdict_(loaded.scene.verdict, loaded.watched_points, com_, loaded.scene.rate) {
    summary_.depth_strip.assign(60, 0);
    last_state_.fill(H6_ACTIVE);  // what needs no event
  }

  Outcome rows(const h6FrameRecord* rows, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) row(rows[i]);
    return recorder_ ? recorder_->frames(rows, count) : Outcome(Done{});
  }
  // Something that the frames do not say themselves.
  void note(const std::string& what, const std::string& detail) {
    event({last_time_, what, "after frame " + std::to_string(frames_) + ": " + detail});
  }
  void finish() {
    if (summary_.interrupted)
      event({last_time_, "interrupted", "by the user; every device was told to stop"});
    summary_.contacts_mean = frames_ ? contacts_ / static_cast<double>(frames_) : 0;
    summary_.verdict = verdict_.verdict();
  }

 private:
  void row(const h6FrameRecord& r) {
    ++frames_;
    const h6FrameReport& f = r.report;
    contacts_ += f.contacts;
    summary_.contacts_max = std::max(summary_.contacts_max, f.contacts);
    summary_.max_depth_voxels = std::max(summary_.max_depth_voxels, f.max_depth_voxels);
    summary_.frame_us.add(f.frame_us);
    summary_.wakeup_us.add(r.wakeup_us);
    summary_.missed_depth_voxels = std::max(summary_.missed_depth_voxels, f.missed_depth_voxels);
    summary_.net_stiffness_max = std::max(summary_.net_stiffness_max, f.net_stiffness_max);
    for (int s = 0; s < H6_STAGE_COUNT; ++s)
      summary_.stage_us[static_cast<std::size_t>(s)].add(f.stage_us[s]);
    for (const h6DeviceCommand& c : r.command) {
      summary_.max_force = std::max(summary_.max_force, norm(c.wrench.force));
      summary_.max_torque = std::max(summary_.max_torque, norm(c.wrench.torque));
    }
    summary_.final_pose = r.body[0].pose;
    summary_.hand_pose = r.hand[0].pose;
    summary_.state_hash = f.state_hash;
    const auto bin = static_cast<std::size_t>(60 * r.time / duration_);
    if (bin < 60)
      summary_.depth_strip[bin] =
          std::max(summary_.depth_strip[bin], static_cast<float>(f.max_depth_voxels));
    verdict_.frame(r.time, r.hand[0].pose, r.hand[0].velocity, r.body[0], f.max_depth_voxels,
                   (f.status & H6_STATE_NOT_FINITE) == 0);
    note_changes(r);
    last_time_ = r.time;
  }

  // An event when a status bit or a cause comes up, not while it stays. What the safety chain did
  // says its cause, and the hand.
  void note_changes(const h6FrameRecord& r) {
    // Late frames have an event each, of their own.
    const h6Status status =
        r.report.status &
        ~static_cast<h6Status>(H6_COUPLING_SATURATED | H6_OUTPUT_CLAMPED | H6_OUTPUT_SLEWED |
                               H6_OUTPUT_FAULT | H6_DEVICE_LOST | H6_LATE);
    const std::string frame = "frame " + std::to_string(r.report.frame);
    for (h6Status bit = 1; h6StatusName(bit); bit <<= 1)
      if ((status & bit) && !(last_status_ & bit)) event({r.time, h6StatusName(bit), frame});
    last_status_ = status;
    if (r.late) late(r);
    for (std::size_t h = 0; h < hands_; ++h) note_hand(r, h, frame);
  }
  void late(const h6FrameRecord& r) {
    const char* cause = r.late & H6_LATE_COMPUTE  ? "late: own computation"
                        : r.late & H6_LATE_STOLEN ? "late: stolen"
                                                  : "late: wake-up";
    char detail[160];
    std::snprintf(detail, sizeof detail,
                  "frame %llu ended %.0f us after its deadline: began %.0f us late, used %.0f us",
                  static_cast<unsigned long long>(r.report.frame), r.late_us, r.wakeup_us,
                  r.cpu_us);
    event({r.time, cause, detail});
  }
  void note_hand(const h6FrameRecord& r, std::size_t h, const std::string& frame) {
    const std::string hand = "hand " + std::to_string(h) + ", " + frame;
    const std::uint32_t causes = r.command[h].causes, fresh = causes & ~last_causes_[h];
    for (int c = 1; c < H6_CAUSE_COUNT; ++c)
      if (fresh >> c & 1u) event({r.time, h6CauseName(static_cast<h6Cause>(c)), hand});
    last_causes_[h] = causes;
    if (r.state[h] == last_state_[h]) return;
    const std::string was = h6DeviceStateName(last_state_[h]);
    last_state_[h] = r.state[h];
    event({r.time, std::string("device ") + h6DeviceStateName(r.state[h]), hand + ", was " + was});
  }
  void event(const io::RecordingEvent& e) {
    if (summary_.events.size() < 1000)
      summary_.events.push_back(e);
    else
      ++summary_.events_dropped;
    if (recorder_) (void)recorder_->event(e);
  }

  RunSummary& summary_;
  io::Recorder* recorder_;
  double duration_;
  std::size_t hands_;
  h6Vec3 com_;
  io::VerdictWatch verdict_;
  std::uint64_t frames_ = 0;
  double contacts_ = 0, last_time_ = 0;
  h6Status last_status_ = 0;
  std::array<std::uint32_t, H6_MAX_HANDS> last_causes_{};
  std::array<h6DeviceState, H6_MAX_HANDS> last_state_{};
};

}  // namespace

Outcome check_options(const RunOptions& options) {
  h6Method method;
  std::uint32_t pieces;
  if (!options.method.empty() && h6MethodFromName(options.method.c_str(), &method, &pieces) != 0)
    return Failure{
        "no method is called '" + options.method +
        "': none, global, cluster, gauss3, gauss6, robust or series, the Gauss ones also "
        "with +facing, +depth, +product, +cluster, +geodesic, +handles, +printed"};
  return options.device.empty() ? Outcome(Done{}) : check_device(options.device);
}

Result<RunSummary> run_scene(const io::LoadedScene& loaded, const RunOptions& options,
                             const Console& console) {
  if (Outcome known = check_options(options); !known) return known.failure();
  RunSetup run(loaded);
  h6SessionDef& def = run.def;
  if (!options.method.empty())
    h6MethodFromName(options.method.c_str(), &def.contact.method, &def.contact.pieces);
  def.threads = options.threads;
  def.frame_budget_us = options.budget_us;
  if (!options.device.empty())
    for (io::SceneHand& hand : run.hands) hand.device = options.device;
  run.record = options.record;
  RunObserver* const observer = options.observer;
  if (observer) observer->prepare(run);
  run.virtual_time = options.virtual_time;
  if (Outcome opened = run.open(); !opened) return opened.failure();
  if (options.virtual_time && !run.devices.real_time.empty())
    return Failure{"the device '" + run.devices.real_time +
                   "' lives in real time: leave out --virtual-time"};
  io::Recorder* recorder = run.recorder.get();

  RunSummary summary;
  summary.method = options.method.empty() ? h6MethodName(def.contact.method) : options.method;
  summary.recording = options.record;
  h6LoopDef loop_def = h6DefaultLoopDef();
  loop_def.duration = options.duration > 0 ? options.duration : loaded.duration();
  loop_def.virtual_time = options.virtual_time;
  loop_def.spin_us = options.spin_us;
  loop_def.ring_frames = 4096;
  loop_def.view_contacts = options.view_contacts;
  summary.seconds = loop_def.duration;
  if (observer && options.duration <= 0) loop_def.duration = 0;
  summary.virtual_time = options.virtual_time;
  Watcher watcher(loaded, summary, summary.seconds, recorder);
  h6Error error{};
  std::unique_ptr<h6Loop, LoopDeleter> loop(
      h6StartLoop(run.session.get(), run.devices.devices.data(), &loop_def, &error));
  if (!loop) return Failure{error.message};
  // A signal stops the devices from its handler and ends the loop after its frame.
  set_signal_hook([](void* context) { h6HaltLoop(static_cast<h6Loop*>(context)); }, loop.get());
  if (interrupted.load()) h6RequestStop(loop.get());

  std::vector<h6FrameRecord> rows(256);
  io::view::Trace trace(static_cast<std::size_t>(kTraceSeconds * def.rate));
  const io::Progress progress = observer ? io::Progress{} : console.progress();
  Outcome watched = Done{};
  if (observer)
    observer->begin(run, loop.get(), [&](const std::string& what, const std::string& detail) {
      watcher.note(what, detail);
    });
  const auto drain = [&] {
    while (const std::size_t n = h6ReadRecords(loop.get(), rows.data(), rows.size())) {
      if (watched)
        watched = watcher.rows(rows.data(), n);
      else
        (void)watcher.rows(nullptr, 0);
      if (observer) observer->rows(rows.data(), n);
      if (!options.trace.empty()) trace.add(rows.data(), n);
      if (progress) progress("running " + loaded.scene.name, rows[n - 1].time / loop_def.duration);
    }
    if (watched && recorder)
      watched = recorder->frames(nullptr, 0);  // what is old enough goes to disk
    if (!watched) h6RequestStop(loop.get());
  };
  while (h6LoopRunning(loop.get())) {
    drain();
    if (observer && !observer->turn()) h6RequestStop(loop.get());
    std::this_thread::sleep_for(std::chrono::milliseconds(options.virtual_time ? 1 : 5));
  }
  summary.loop = h6JoinLoop(loop.get());
  set_signal_hook(nullptr, nullptr);
  drain();
  if (progress) progress("running", 1);
  if (observer) observer->end();
  if (!watched) return watched.failure();
  const bool endless = loop_def.duration == 0;  // then that is how it ends
  summary.interrupted = !endless && interrupted.load() &&
                        static_cast<double>(summary.loop.frames) < summary.seconds * def.rate - 0.5;
  watcher.finish();
  if (!options.trace.empty())
    if (Outcome written = trace.write(options.trace); !written) return written.failure();
  if (def.hand_count == 0)  // nobody holds anything: the first body that moves
    for (std::size_t b = 0; b < def.body_count; ++b)
      if (!def.bodies[b].fixed) {
        summary.final_pose = summary.hand_pose =
            h6GetBody(run.session.get(), static_cast<int32_t>(b)).pose;
        break;
      }
  if (recorder)
    if (Outcome done =
            recorder->finish(Console::text(to_json(summary, loaded, options.virtual_time)));
        !done)
      return done.failure();
  return summary;
}

namespace {

// How late frames were, by cause: how many within each power of ten.
ordered_json late_json(const h6LoopReport& report) {
  const auto bins = [](const h6LateHistogram& h) {
    static const char* const names[H6_LATE_BINS] = {"10",    "100",    "1000",
                                                    "10000", "100000", "longer"};
    ordered_json out = ordered_json::object();
    for (int i = 0; i < H6_LATE_BINS; ++i) out[names[i]] = h.frames[i];
    return out;
  };
  return {{"compute", bins(report.late_us_compute)},
          {"wakeup", bins(report.late_us_wakeup)},
          {"stolen", bins(report.late_us_stolen)}};
}

ordered_json grant_json(const h6Granted& g) {
  return {{"core", g.core < 0 ? ordered_json() : ordered_json(g.core)},
          {"fifo", g.fifo},
          {"locked", g.locked},
          {"isolated", g.isolated},
          {"governor", g.governor[0] ? ordered_json(g.governor) : ordered_json()}};
}

// What the safety chain did for each hand: only causes that came up.
ordered_json safety_json(const h6LoopReport& loop, std::size_t hands) {
  ordered_json all = ordered_json::array();
  for (std::size_t h = 0; h < hands; ++h) {
    const h6HandSafety& s = loop.hand[h];
    ordered_json causes = ordered_json::object();
    for (int c = 1; c < H6_CAUSE_COUNT; ++c)
      if (s.times[c] > 0)
        causes[h6CauseName(static_cast<h6Cause>(c))] = {{"times", s.times[c]},
                                                        {"frames", s.frames[c]}};
    all.push_back({{"state", h6DeviceStateName(s.state)},
                   {"fault", h6CauseName(s.fault)},
                   {"causes", causes}});
  }
  return all;
}

}  // namespace

ordered_json to_json(const RunSummary& s, const io::LoadedScene& loaded, bool virtual_time) {
  const double scale = 1 / io::metres(loaded.scene.unit);
  const auto pose = [&](const h6Pose& p) {
    return ordered_json{{"p", {p.p.x * scale, p.p.y * scale, p.p.z * scale}},
                        {"q", {p.q.w, p.q.x, p.q.y, p.q.z}}};
  };
  const auto spread = [](const Histogram& h) {
    return ordered_json{{"p50", h.percentile(50)},
                        {"p99", h.percentile(99)},
                        {"p999", h.percentile(99.9)},
                        {"max", h.max()}};
  };
  ordered_json stages = ordered_json::object();
  for (int i = 0; i < H6_STAGE_COUNT; ++i)
    stages[h6StageName(static_cast<h6Stage>(i))] = spread(s.stage_us[static_cast<std::size_t>(i)]);
  ordered_json events = ordered_json::array(), status = ordered_json::array(),
               assets = ordered_json::array();
  for (const io::RecordingEvent& e : s.events)
    events.push_back({{"t", e.time}, {"what", e.what}, {"detail", e.detail}});
  for (h6Status bit = 1; h6StatusName(bit); bit <<= 1)
    if (s.loop.status & bit) status.push_back(h6StatusName(bit));
  for (const io::LoadedAsset& a : loaded.assets) {
    ordered_json asset{{"body", a.body},
                       {"kind", a.is_field ? "field" : "shell"},
                       {"from_cache", a.from_cache},
                       {"rebuilt", a.rebuilt},
                       {"seconds", a.seconds},
                       {"hash", a.hash}};
    if (a.is_field)
      asset.update({{"voxel_size", a.voxel_size}, {"dims", a.nodes}, {"bricks", a.bricks}});
    else
      asset.update({{"points", a.points}, {"levels", a.levels}});
    assets.push_back(asset);
  }
  char hash[20];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(s.state_hash));
  ordered_json json{
      {"scene", loaded.scene.name},
      {"method", s.method},
      {"units", io::unit_name(loaded.scene.unit)},
      {"virtual_time", virtual_time},
      {"frames", s.loop.frames},
      {"contacts", {{"mean", s.contacts_mean}, {"max", s.contacts_max}}},
      {"max_depth_voxels", s.max_depth_voxels},
      {"verdict", io::verdict_name(s.verdict)},
      {"frame_us", spread(s.frame_us)},
      {"stage_us", stages},
      {"wakeup_us", spread(s.wakeup_us)},
      {"deadline",
       {{"missed_compute", s.loop.late_compute},
        {"missed_wakeup", s.loop.late_wakeup},
        {"missed_stolen", s.loop.late_stolen},
        {"late_us", late_json(s.loop)}}},
      {"coarse",
       {{"frames", s.loop.coarse_frames}, {"missed_depth_voxels", s.missed_depth_voxels}}},
      {"final_pose", pose(s.final_pose)},
      {"hand_pose", pose(s.hand_pose)},
      {"max_force", s.max_force},
      {"max_torque", s.max_torque},
      {"status_bits", s.loop.status},
      {"status", status},
      {"fault", h6CauseName(s.loop.fault)},
      {"safety", safety_json(s.loop, loaded.hands.size())},
      {"watchdog_trips", s.loop.watchdog_trips},
      {"state_hash", hash},
      {"records_lost", s.loop.ring_overruns},
      {"simd_target", kernels::target_name()},
      {"realtime", s.loop.granted},
      {"granted", grant_json(s.loop.grant)},
      {"assets", assets},
      {"events", events},
      {"events_dropped", s.events_dropped},
      {"interrupted", s.interrupted}};
  if (loaded.scene.net_stiffness) json["net_stiffness"] = {{"max", s.net_stiffness_max}};
  if (!s.recording.empty()) json["recording"] = s.recording;
  return json;
}

}  // namespace h6::cli
