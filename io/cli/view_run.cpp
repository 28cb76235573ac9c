// SPDX-License-Identifier: Apache-2.0
#include "io/cli/view_run.h"

#include <sys/stat.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <variant>

#include "device/steering.h"
#include "hapsix/vector.h"
#include "io/console/checks.h"
#include "io/run/recorded_run.h"
#include "io/run/run_observer.h"
#include "io/view/browser.h"
#include "io/view/live_state.h"
#include "io/view/page.h"
#include "io/view/view_request.h"
#include "io/view/view_server.h"

namespace h6::cli {
namespace {

using Clock = std::chrono::steady_clock;
using io::view::ViewRequest;

constexpr auto kPicture = std::chrono::microseconds(16667);
constexpr auto kBackground = std::chrono::seconds(1);
constexpr double kMostDepth = 2;       // where a run may begin again [voxel]; check_start refuses 3
constexpr double kGlide = 2;           // of a hand that is let go there, to its path [s]
constexpr std::size_t kWaiting = 256;  // most requests of the page that may wait
constexpr std::size_t kViewContacts = 2000;  // most contacts drawn as arrows

// Carries requests from the server's thread to the program's.
class Wishes {
 public:
  void add(std::string_view text) {
    Result<ViewRequest> request = io::view::parse_request(text);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!request) {
      refused_ = request.error();
      return;
    }
    // Only the hand's latest position counts, so it replaces one that still waits.
    if (std::holds_alternative<io::view::MoveHand>(*request) && !waiting_.empty() &&
        std::holds_alternative<io::view::MoveHand>(waiting_.back()))
      waiting_.pop_back();
    if (waiting_.size() < kWaiting) waiting_.push_back(*request);
  }
  std::deque<ViewRequest> take(std::string* refused) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::deque<ViewRequest> all;
    all.swap(waiting_);
    refused->swap(refused_);
    refused_.clear();
    return all;
  }

 private:
  std::mutex mutex_;
  std::deque<ViewRequest> waiting_;
  std::string refused_;
};

// The contact settings as the engine uses them.
h6ContactDef in_use(const io::LoadedScene& loaded, h6ContactDef contact) {
  h6SessionDef def = loaded.session_def();
  def.contact = contact;
  contact.stiffness = h6StiffnessFor(loaded.model.get(), &def);
  return contact;
}

class Viewer : public RunObserver {
 public:
  Viewer(const io::LoadedScene& loaded, const ViewOptions& options, const Console& console)
      : loaded_(loaded), options_(options), console_(console), state_(loaded) {}

  Outcome open(const h6ContactDef& contact, const h6CouplingDef& coupling) {
    const std::string_view page = io::view::live_page();
    if (page.empty()) return Failure{io::view::no_page()};
    io::view::ServerOptions options;
    options.port = static_cast<std::uint16_t>(options_.port);
    Result<std::unique_ptr<io::view::ViewServer>> server = io::view::ViewServer::open(
        options, std::string(page), [this](std::string_view text) { wishes_.add(text); });
    if (!server) return server.failure();
    server_ = std::move(*server);
    contact_ = contact;
    coupling_ = coupling;
    state_.settings(in_use(loaded_, contact_), coupling_);
    std::vector<std::string> remarks;
    server_->greet(state_.scene_message(remarks));
    console_.warn(remarks);
    const bool shown = options_.open && browser_.open(server_->address());
    console_.log("view: " + server_->address() + (shown ? "" : "  (open it in a browser here)"));
    return Done{};
  }

  bool again() const { return again_; }
  const std::string& record() const { return record_; }

  void prepare(RunSetup& setup) override {
    again_ = false;
    wish_ = {};
    steering_ = std::make_shared<device::Steering>();
    setup.steering = steering_;
    for (h6HandDef& hand : setup.hand_defs) hand.filter.clutch_buttons |= 1;
    apply(setup);
    if (from_) start_from(*from_, setup);
  }

  void begin(RunSetup& setup, h6Loop* loop, Note note) override {
    setup_ = &setup;
    loop_ = loop;
    h6SetPace(loop_, pace_);  // the page shows this pace
    note_ = std::move(note);
    offset_ = {};
    tell_settings(setup.session.get());
    state_.begin();
    state_.recording(setup.recorder != nullptr);
    if (!from_) overlaps_ = setup.overlaps;
    next_ = Clock::now();
  }

  void rows(const h6FrameRecord* rows, std::size_t count) override { state_.rows(rows, count); }

  bool turn() override {
    std::string refused;
    for (const ViewRequest& wish : wishes_.take(&refused))
      std::visit([this](const auto& w) { act(w); }, wish);
    if (!refused.empty()) server_->say(io::view::LiveState::note(refused));
    tell_overlaps();
    h6LoopView view;
    if (h6ReadView(loop_, &view)) {
      state_.contacts(view);
      bodies_.assign(view.bodies, view.bodies + view.body_count);
    }
    publish();
    return !again_;
  }

  // A driver that may hang is no simulated hand and has the full pace.
  bool paused() const override { return pace_ < 0.01; }

  void end() override {
    loop_ = nullptr;
    setup_ = nullptr;
    note_ = nullptr;
  }

 private:
  // A page that draws slowly gets fewer messages, with all rows in them. One that draws nothing
  // (it is in the background) gets one a second.
  void publish() {
    const auto now = Clock::now();
    if (now < next_ || !state_.any() || server_->clients() == 0) return;
    if (!server_->ready() && now - published_ < kBackground) return;
    next_ = std::max(next_ + kPicture, now - kPicture);
    published_ = now;
    server_->publish(state_.state_message());
  }
  void tell_settings(const h6Session* session) {
    h6CouplingDef coupling = coupling_;
    if (!loaded_.hands.empty()) coupling = h6GetCoupling(session, 0);
    state_.settings(in_use(loaded_, contact_), coupling);
  }
  // Each page that opens is told what overlaps at the start.
  void tell_overlaps() {
    const std::size_t clients = server_->clients();
    if (clients > greeted_ && !overlaps_.empty()) {
      std::string text;
      for (const PartOverlap& o : overlaps_) text += (text.empty() ? "" : "; ") + o.sentence;
      server_->say(io::view::LiveState::note(text));
    }
    greeted_ = clients;
  }
  void act(const io::view::Grab& grab) {
    wish_.held = grab.on;
    wish_.placed = false;
    steering_->wish(wish_);
  }
  // The page gives positions in the scene. After clutching, the device's frame is shifted from it.
  void act(const io::view::MoveHand& move) {
    if (!wish_.held) return;
    if (!wish_.clutched && state_.any()) {
      const h6FrameRecord& r = state_.last();
      offset_ = r.hand[0].pose.p - r.command[0].pose.p;
    }
    wish_.placed = true;
    wish_.pose = move.pose;
    wish_.pose.p = move.pose.p + offset_;
    steering_->wish(wish_);
  }
  void act(const io::view::Clutch& clutch) {
    wish_.clutched = clutch.on;
    steering_->wish(wish_);
  }
  void act(const io::view::SetContact& set) {
    const h6ContactDef before = contact_;
    const h6CouplingDef coupling_before = coupling_;
    if (!set.method.empty())
      h6MethodFromName(set.method.c_str(), &contact_.method, &contact_.pieces);
    if (set.stiffness > 0) contact_.stiffness = set.stiffness;
    if (set.epsilon > 0) {
      const double torque_to_normal = contact_.epsilon_torque / contact_.epsilon_normal;
      if (contact_.method == H6_METHOD_ROBUST) {
        contact_.epsilon_normal = set.epsilon;
        contact_.epsilon_torque = std::min(2.0, set.epsilon * torque_to_normal);
      } else {
        contact_.epsilon = set.epsilon;
      }
    }
    if (set.hand_stiffness > 0) {
      // A rotational stiffness of the scene's own keeps its lever; the engine derives one of 0.
      const double before_now = h6GetCoupling(setup_->session.get(), 0).stiffness;
      coupling_.rotational_stiffness *= set.hand_stiffness / before_now;
      coupling_.stiffness = set.hand_stiffness;
    }
    if (set.max_depth_voxels > 0) {
      coupling_.max_depth_voxels = set.max_depth_voxels;
      coupling_.max_force = coupling_.max_torque =
          0;  // the engine then derives both from the new stiffness
    }
    apply(*setup_);
    h6Error error{};
    SessionPtr next(h6CreateSession(loaded_.model.get(), &setup_->def, &error));
    h6Session* old = next ? h6ChangeSession(loop_, next.get(), &error) : nullptr;
    if (!old) {
      contact_ = before;
      coupling_ = coupling_before;
      apply(*setup_);
      server_->say(io::view::LiveState::note(error.message));
      return;
    }
    (void)setup_->session.release();  // the next line destroys it as `old`
    h6DestroySession(old);
    setup_->session = std::move(next);
    tell_settings(setup_->session.get());
    note_("settings", io::settings_text(contact_, coupling_));
  }
  void act(const io::view::SetPace& set) {
    if (!setup_->devices.real_time.empty())  // a slower pace would give it too few commands
      return server_->say(io::view::LiveState::note("the device '" + setup_->devices.real_time +
                                                    "' lives on the clock: no slow motion"));
    pace_ = set.pace;
    h6SetPace(loop_, pace_);
  }
  void act(const io::view::Reset&) {
    record_.clear();
    from_.reset();
    again_ = true;
  }
  void act(const io::view::Keep&) {
    if (!state_.any() || bodies_.size() != loaded_.bodies.size()) return;
    if (const char* why = stays()) return say(why);
    const h6FrameRecord& r = state_.last();
    if (r.report.max_depth_voxels > kMostDepth)
      return say("the part is too deep in contact to begin here again: move it out a little");
    kept_.emplace();
    kept_->bodies = bodies_;
    for (std::size_t h = 0; h < loaded_.hands.size(); ++h)
      kept_->hands.push_back(r.command[h].pose);
    say("kept: U or ‘back to it’ returns here");
  }
  void act(const io::view::GoBack&) {
    if (const char* why = stays()) return say(why);
    if (!record_.empty())
      return say("a recording begins at the start and has no way back: stop it first");
    from_ = kept_;  // nothing was kept: the start
    again_ = true;
  }
  // Why the hands cannot be put back to another place; null: they can.
  const char* stays() const {
    for (const io::SceneHand& hand : setup_->hands)
      if (hand.device != "path" && hand.device != "simulated")
        return "a real hand cannot be put back: keep and back are for simulated hands";
    return nullptr;
  }
  void say(const std::string& text) const { server_->say(io::view::LiveState::note(text)); }
  void act(const io::view::Record& record) {
    if (record.on == !record_.empty()) return;
    again_ = true;
    from_.reset();
    if (!record.on) {
      server_->say(io::view::LiveState::note("recorded: " + record_));
      record_.clear();
      return;
    }
    struct stat exists;
    int n = 1;
    // A name of a stranger's scene leads to no other folder.
    std::string name = loaded_.scene.name;
    std::replace(name.begin(), name.end(), '/', '_');
    do record_ = options_.folder + "/" + name + "-view-" + std::to_string(n++) + ".h5";
    while ((stat(record_.c_str(), &exists) == 0 ||
            stat((record_ + ".part").c_str(), &exists) == 0) &&  // left by a killed run
           n < 10000);
    server_->say(io::view::LiveState::note("recording from the start: " + record_));
  }
  void act(const io::view::Slice& slice) {
    if (const auto message = state_.slice_message(slice)) server_->say(message);
  }

  // Where all bodies and hands were; they start there at rest.
  struct Place {
    std::vector<h6Pose> bodies, hands;
  };
  // The first hand is held there, as the mouse held it. Let go, it glides to the start of its path.
  void start_from(const Place& place, RunSetup& setup) {
    placed_.assign(setup.def.bodies, setup.def.bodies + setup.def.body_count);
    for (std::size_t b = 0; b < placed_.size(); ++b)
      if (!placed_[b].fixed) placed_[b].pose = place.bodies[b];
    setup.def.bodies = placed_.data();
    // What overlaps in contact is a push, not a fit: it is relieved only where parts overlap by
    // design.
    if (overlaps_.empty()) setup.def.contact.fit = H6_FIT_TIGHT;
    for (std::size_t h = 0; h < setup.hands.size(); ++h) {
      io::Path path{{0, place.hands[h]}};
      for (const io::PathRow& row : setup.hands[h].path)
        path.push_back({row.t - setup.hands[h].path.front().t + kGlide, row.pose});
      setup.hands[h].path = std::move(path);
    }
    if (place.hands.empty()) return;
    wish_.held = wish_.placed = true;
    wish_.pose = place.hands[0];
    steering_->wish(wish_);
  }

  void apply(RunSetup& setup) const {
    setup.def.contact = contact_;
    for (h6HandDef& hand : setup.hand_defs) hand.coupling = coupling_;
  }

  const io::LoadedScene& loaded_;
  const ViewOptions& options_;
  const Console& console_;
  io::view::LiveState state_;
  Wishes wishes_;
  io::view::Browser browser_;
  std::unique_ptr<io::view::ViewServer> server_;  // last: its thread calls the members above
  h6ContactDef contact_{};
  h6CouplingDef coupling_{};
  std::shared_ptr<device::Steering> steering_;
  device::Steering::Wish wish_;
  h6Vec3 offset_{};
  std::vector<h6Pose> bodies_;        // in the newest picture
  std::optional<Place> kept_, from_;  // from_: where this run began; none: the scene's start
  std::vector<h6BodyDef> placed_;     // of a run that began elsewhere
  std::vector<PartOverlap> overlaps_;
  std::size_t greeted_ = 0;  // open pages that know of `overlaps_`
  RunSetup* setup_ = nullptr;
  h6Loop* loop_ = nullptr;
  Note note_;
  std::string record_;
  bool again_ = false;
  double pace_ = 1;
  Clock::time_point next_, published_;
};

}  // namespace

void add_view_options(CLI::App& command, ViewOptions& view) {
  command.add_flag("--view", view.on,
                   "Show it live in a browser, where the part can be taken in hand; ends with "
                   "Ctrl-C, or when a duration that was asked for is over");
  command.add_option("--port", view.port, "Port of the view on 127.0.0.1; default: any free one")
      ->option_text("NUMBER")
      ->check(whole_within(0, 65535));
  command.add_flag_callback(
      "--no-browser", [&view] { view.open = false; }, "Only print the view's address");
}

Outcome view_scene(const io::LoadedScene& loaded, const RunOptions& given, const ViewOptions& view,
                   const Console& console, const std::function<void(const RunSummary&)>& done) {
  RunOptions options = given;
  Viewer viewer(loaded, view, console);
  h6ContactDef contact = loaded.session_def().contact;
  if (!options.method.empty())
    h6MethodFromName(options.method.c_str(), &contact.method, &contact.pieces);
  options.method.clear();  // from now on the viewer sets the method
  const h6CouplingDef coupling =
      loaded.hands.empty() ? h6DefaultCouplingDef() : loaded.hands[0].coupling;
  if (Outcome opened = viewer.open(contact, coupling); !opened) return opened;
  options.observer = &viewer;
  options.view_contacts = kViewContacts;
  do {
    if (!viewer.record().empty()) options.record = viewer.record();
    Result<RunSummary> summary = run_scene(loaded, options, console);
    if (!summary) return summary.failure();
    done(*summary);
    options.record.clear();
    if (summary->interrupted || interrupted.load()) break;
  } while (viewer.again());
  return Done{};
}

}  // namespace h6::cli
