// SPDX-License-Identifier: Apache-2.0
// recorded_session.cpp - runs a recording again.
#include "io/run/recorded_session.h"

#include <algorithm>
#include <cstring>

#include "kernels/targets.h"

namespace h6::cli {
namespace {

// Switches to the SIMD target of the recording if this machine has it, because another target gives
// other bits.
void take_target(const std::string& recorded, std::vector<std::string>& remarks) {
  if (recorded == kernels::target_name()) return;
  if (kernels::force_target(recorded.c_str()))
    remarks.push_back("recorded on " + recorded +
                      ", which is not this machine's best: replayed on that");
  else
    remarks.push_back("recorded on " + recorded +
                      ", which this machine or build does not have: replayed on " +
                      kernels::target_name() + ", bits will differ");
}

bool same_bends(const std::vector<io::RecordedBend>& a, const std::vector<io::RecordedBend>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.body == y.body && x.modes == y.modes;
  });
}

bool has_column(const io::Recording& recording, const char* name) {
  const std::vector<std::string>& all = recording.columns;
  return std::find(all.begin(), all.end(), name) != all.end();
}

}  // namespace

Result<std::unique_ptr<RecordedSession>> RecordedSession::open(const std::filesystem::path& file,
                                                               const io::Recording& recording,
                                                               const Changes& changes,
                                                               const io::Progress& progress,
                                                               std::vector<std::string>& remarks) {
  const io::RecordingHead& head = recording.head;
  Result<io::RecordedRun> run = io::recorded_run(head);
  if (!run) return run.failure();
  std::unique_ptr<RecordedSession> s(new RecordedSession());
  s->run_ = std::move(*run);
  take_target(head.simd_target, remarks);
  Result<std::unique_ptr<io::LoadedScene>> loaded =
      io::load_recorded(head, s->run_, file, progress);
  if (!loaded) return loaded.failure();
  s->loaded_ = std::move(*loaded);
  s->hands_ = head.hands;
  s->bends_ = recorded_bends(*s->loaded_);
  if (s->loaded_->hands.size() != head.hands)
    return Failure{"its scene has another number of hands than its rows"};
  if (!head.bends.empty() && !same_bends(head.bends, s->bends_))
    return Failure{"other bodies of its scene bend than its rows say"};
  h6SessionDef& def = s->def_ = s->loaded_->session_def();
  s->hand_defs_ = s->loaded_->hands;
  def.hands = s->hand_defs_.data();
  def.threads = s->threads_ = changes.threads ? changes.threads : s->run_.threads;
  def.max_contacts = s->run_.max_contacts;
  def.max_pairs = s->run_.max_pairs;
  def.gravity = s->run_.gravity;
  s->method_ = s->recorded_method_ = h6MethodName(def.contact.method);
  s->own_method_ = !changes.method.empty();
  if (s->own_method_) {
    s->method_ = changes.method;
    h6MethodFromName(changes.method.c_str(), &def.contact.method, &def.contact.pieces);
  }
  s->has_inputs_ = has_column(recording, "safety_asked") && has_column(recording, "overdue");
  s->says_when_ = has_column(recording, "settings");
  for (const io::RecordingEvent& event : recording.events)
    if (event.what == "settings") s->settings_.push_back(event);
  h6Error error{};
  s->session_.reset(h6CreateSession(s->loaded_->model.get(), &def, &error));
  if (!s->session_) return Failure{error.message};
  for (std::size_t h = 0; h < s->hands_; ++h)
    h6SetRating(s->session_.get(), static_cast<std::int32_t>(h), &s->run_.ratings[h]);
  return s;
}

// Gives the safety chains their recorded inputs: faults of devices, missed deadlines, and requests
// of the program.
void RecordedSession::set_faults(const h6FrameRecord& recorded) {
  if (has_inputs_) {
    for (std::size_t h = 0; h < hands_; ++h)
      h6SetSafetyInput(session_.get(), static_cast<std::int32_t>(h), &recorded.safety_input[h]);
    return;
  }
  // Older recordings lack these inputs, so the faults are derived from the recorded output.
  const bool latched = recorded.report.status & H6_OUTPUT_FAULT;
  if (latched_ && !latched) h6Rearm(session_.get());
  latched_ = latched;
  for (std::size_t h = 0; latched && h < hands_; ++h) {
    const h6Cause cause = recorded.command[h].cause;
    if (cause == H6_CAUSE_DEVICE_LOST || cause == H6_CAUSE_STOPPED || cause == H6_CAUSE_LATE)
      return h6Fault(session_.get(), cause);
  }
}

// Applies the settings that a user changed in the live view before this frame.
Outcome RecordedSession::follow_settings(const h6FrameRecord& recorded) {
  const std::string at = "frame " + std::to_string(recorded.report.frame) + ": ";
  if (!says_when_) {
    if (settings_.empty() || recorded.time <= settings_[0].time) return Done{};
    return Failure{at + "its settings were changed here (" + settings_[0].detail +
                   "), and the program that made it did not say in which frame; up to here it was "
                   "replayed. Recordings of this program go on"};
  }
  for (; changed_ < recorded.settings; ++changed_) {
    if (changed_ >= settings_.size())
      return Failure{at + "its settings were changed, and the event that says how is missing"};
    if (Outcome changed = change_settings(settings_[changed_].detail); !changed)
      return Failure{at + "its settings were changed; " + changed.error()};
  }
  return Done{};
}

Outcome RecordedSession::change_settings(const std::string& detail) {
  h6ContactDef contact = def_.contact;
  for (h6HandDef& hand : hand_defs_)
    if (Outcome taken = io::take_settings(detail, contact, hand.coupling); !taken) return taken;
  if (own_method_) contact.method = def_.contact.method, contact.pieces = def_.contact.pieces;
  def_.contact = contact;
  h6Error error{};
  SessionPtr next(h6CreateSession(loaded_->model.get(), &def_, &error));
  if (!next || !h6TakeOver(next.get(), session_.get(), &error)) return Failure{error.message};
  session_ = std::move(next);
  return Done{};
}

// Where the devices were stopped while a frame was computed, the loop sent another command. Only
// the recorded cause tells that; the command itself follows from it.
void RecordedSession::hold_back(const h6FrameRecord& recorded) {
  for (std::size_t h = 0; h < hands_; ++h) {
    const h6DeviceCommand& told = recorded.command[h];
    h6DeviceCommand& command = now_.command[h];
    if (told.cause != H6_CAUSE_STOPPED && told.cause != H6_CAUSE_WATCHDOG) continue;
    if (command.cause == told.cause && command.causes == told.causes &&
        (recorded.inputs_only || std::memcmp(&command.pose, &told.pose, sizeof told.pose) == 0))
      continue;
    command.wrench = {};
    command.velocity = {};
    if (hand_defs_[h].mode != H6_IMPEDANCE && any_sent_) command.pose = sent_[h];
    command.cause = told.cause;
    command.causes |= 1u << told.cause;
  }
}

Result<const h6FrameRecord*> RecordedSession::step(const h6FrameRecord& recorded) {
  if (Outcome followed = follow_settings(recorded); !followed) return followed.failure();
  set_faults(recorded);
  now_ = {};
  now_.settings = recorded.settings;
  std::copy(std::begin(recorded.hand), std::end(recorded.hand), now_.hand);
  // In the recorded run the clock decided how much the anytime mode left out.
  h6SetCoarse(session_.get(), recorded.report.coarse_pairs, recorded.report.coarse_points);
  h6Step(session_.get(), now_.hand, now_.command);
  hold_back(recorded);
  for (std::size_t h = 0; h < hands_; ++h)
    sent_[h] = (recorded.inputs_only ? now_ : recorded).command[h].pose;
  any_sent_ = true;
  now_.report = h6GetFrame(session_.get());
  now_.time = static_cast<double>(now_.report.frame) * (1 / def_.rate);
  for (std::size_t h = 0; h < hands_; ++h) {
    now_.body[h] = h6GetBody(session_.get(), loaded_->hands[h].body);
    h6HandSafety safety;
    h6GetSafety(session_.get(), static_cast<std::int32_t>(h), &safety);
    now_.state[h] = safety.state;
  }
  now_bends_.clear();
  append_bends(session_.get(), bends_, now_bends_);
  return &now_;
}

}  // namespace h6::cli
