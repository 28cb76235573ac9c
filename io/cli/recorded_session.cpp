#include "io/cli/recorded_session.h"

#include <algorithm>

#include "kernels/targets.h"

namespace h6::cli {
namespace {

// The instruction set decides about bits: that of the recording where this machine has it.
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

}  // namespace

Result<std::unique_ptr<RecordedSession>> RecordedSession::open(const std::filesystem::path& file,
                                                               const io::RecordingHead& head,
                                                               const Changes& changes,
                                                               const io::Progress& progress,
                                                               std::vector<std::string>& remarks) {
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
  if (s->loaded_->hands.size() != head.hands)
    return Failure{"its scene has another number of hands than its rows"};
  h6SessionDef def = s->loaded_->session_def();
  def.threads = s->threads_ = changes.threads ? changes.threads : s->run_.threads;
  def.max_contacts = s->run_.max_contacts;
  def.gravity = s->run_.gravity;
  s->method_ = s->recorded_method_ = h6MethodName(def.contact.method);
  if (!changes.method.empty()) {
    s->method_ = changes.method;
    h6MethodFromName(changes.method.c_str(), &def.contact.method, &def.contact.pieces);
  }
  h6Error error{};
  s->session_.reset(h6CreateSession(s->loaded_->model.get(), &def, &error));
  if (!s->session_) return Failure{error.message};
  for (std::size_t h = 0; h < s->hands_; ++h)
    h6SetRating(s->session_.get(), static_cast<std::int32_t>(h), &s->run_.ratings[h]);
  return s;
}

// Faults that come from outside the frame: from devices, deadlines, the program. Set as recorded.
void RecordedSession::set_faults(const h6FrameRecord& recorded) {
  const bool latched = recorded.report.status & H6_OUTPUT_FAULT;
  if (latched_ && !latched) h6Rearm(session_.get());
  latched_ = latched;
  for (std::size_t h = 0; latched && h < hands_; ++h) {
    const h6Cause cause = recorded.command[h].cause;
    if (cause == H6_CAUSE_DEVICE_LOST || cause == H6_CAUSE_STOPPED || cause == H6_CAUSE_LATE)
      return h6Fault(session_.get(), cause);
  }
}

const h6FrameRecord& RecordedSession::step(const h6FrameRecord& recorded) {
  set_faults(recorded);
  now_ = {};
  now_.time = recorded.time;
  std::copy(std::begin(recorded.hand), std::end(recorded.hand), now_.hand);
  h6SetCoarse(session_.get(), recorded.report.coarse_pairs);  // what the clock decided then
  h6Step(session_.get(), now_.hand, now_.command);
  now_.report = h6GetFrame(session_.get());
  for (std::size_t h = 0; h < hands_; ++h)
    now_.body[h] = h6GetBody(session_.get(), loaded_->hands[h].body);
  return now_;
}

}  // namespace h6::cli
