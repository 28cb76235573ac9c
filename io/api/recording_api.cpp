// SPDX-License-Identifier: Apache-2.0
// recording_api.cpp - writes and reads recordings, for C.
#include <algorithm>

#include "io/api/guard.h"
#include "io/api/scene_object.h"
#include "io/record/recording.h"
#include "io/scene/scene_file.h"
#include "runtime/base/foreign_enum.h"

using namespace h6;
using namespace h6::io;

struct h6Recorder {
  std::unique_ptr<Recorder> recorder;
  std::size_t modes = 0;  // of all bodies of its scene that bend
};
struct h6Recording {
  std::filesystem::path file;
  Recording head;  // without frames
};

namespace {

RecordingHead head_of(const h6RecorderDef& def, const h6SessionDef& session) {
  RecordingHead head;
  if (def.scene) {
    Scene scene = def.scene->loaded->scene;
    scene.contact = session.contact;
    scene.rate = session.rate;
    head.scene_json = scene_text(scene);
    for (const LoadedAsset& asset : def.scene->loaded->assets)
      head.asset_hashes.push_back(asset.hash);
    const auto& bends = def.scene->loaded->bends;
    for (std::size_t b = 0; b < bends.size(); ++b)
      if (bends[b])
        head.bends.push_back(
            {static_cast<std::uint32_t>(b), scene.bodies[b].name, bends[b]->modes});
  }
  head.rate = session.rate;
  head.hands = session.hand_count;
  head.program = def.program ? def.program : h6BuildInfo();
  return head;
}

}  // namespace

extern "C" {

h6RecorderDef h6DefaultRecorderDef(void) { return {}; }

h6Recorder* h6CreateRecorder(const char* file, const h6RecorderDef* def, h6Error* error) {
  if (!file || !*file || !def || (!def->scene && !def->session))
    return fill(error, H6_ERROR_ARGUMENT, "a recorder needs a file, and a scene or a session"),
           nullptr;
  if (!understood(*def, error) || (def->session && !understood(*def->session, error)))
    return nullptr;
  return guarded(error, static_cast<h6Recorder*>(nullptr), [&]() -> h6Recorder* {
    const h6SessionDef session = def->session ? *def->session : def->scene->loaded->session_def();
    if (session.hand_count < 1 || session.hand_count > H6_MAX_HANDS)
      return fill(error, H6_ERROR_ARGUMENT, "a recording has 1 to 8 hands"), nullptr;
    if (!(session.rate > 0 && session.rate <= 1e6))
      return fill(error, H6_ERROR_RANGE, "the rate must be above 0 and at most 1000000 Hz"),
             nullptr;
    if (raw_number(session.contact.method) >= H6_METHOD_COUNT)
      return fill(error, H6_ERROR_RANGE, "contact.method must be one of h6Method"), nullptr;
    const RecordingHead head = head_of(*def, session);
    if (def->scene) {  // or nobody could replay it
      const Result<Scene> again = read_scene_text(head.scene_json, "the session");
      if (!again) return fill(error, H6_ERROR_RANGE, again.error()), nullptr;
    }
    h6Recorder* made = wrap<h6Recorder>(Recorder::create(file, head), H6_ERROR_FILE, error);
    if (made) made->modes = modes_of(head.bends);
    return made;
  });
}

bool h6RecordFrames(h6Recorder* recorder, const h6FrameRecord* rows, size_t count, h6Error* error) {
  return h6RecordFramesWithBends(recorder, rows, count, nullptr, 0, error);
}

bool h6RecordFramesWithBends(h6Recorder* recorder, const h6FrameRecord* rows, size_t count,
                             const double* bends, size_t modes, h6Error* error) {
  if (!recorder || (count && !rows) || count > PTRDIFF_MAX / sizeof *rows)
    return fill(error, H6_ERROR_ARGUMENT, "a recorder and rows are needed"), false;
  if (bends && modes != recorder->modes)
    return fill(error, H6_ERROR_ARGUMENT,
                "the bodies of the recorder's scene bend by " + std::to_string(recorder->modes) +
                    " modes, not " + std::to_string(modes)),
           false;
  return guarded(error, false, [&] {
    return finish(recorder->recorder->frames(rows, count, bends), H6_ERROR_FILE, error);
  });
}

bool h6FinishRecorder(h6Recorder* recorder, const char* summary, h6Error* error) {
  if (!recorder) return fill(error, H6_ERROR_ARGUMENT, "no recorder was given"), false;
  return guarded(error, false, [&] {
    return finish(recorder->recorder->finish(summary ? summary : "{}"), H6_ERROR_FILE, error);
  });
}

void h6DestroyRecorder(h6Recorder* recorder) { delete recorder; }

h6Recording* h6ReadRecording(const char* file, h6Error* error) {
  if (!file) return fill(error, H6_ERROR_ARGUMENT, "no file was given"), nullptr;
  return guarded(error, static_cast<h6Recording*>(nullptr), [&]() -> h6Recording* {
    Result<Recording> head = read_recording(file, {0, 0});
    if (!head) return fill(error, reading(file), head.error()), nullptr;
    if (!head->remark.empty()) h6Log(H6_LOG_WARNING, head->remark.c_str());
    return new h6Recording{file, std::move(*head)};
  });
}

void h6DestroyRecording(h6Recording* recording) { delete recording; }

void h6GetRecording(const h6Recording* recording, h6RecordingInfo* out) {
  if (!out) return;
  *out = {};
  if (!recording) return;
  const Recording& r = recording->head;
  *out = {r.frame_count,
          r.head.rate,
          r.head.hands,
          r.events.size(),
          r.whole,
          r.head.scene_json.c_str(),
          r.head.program.c_str(),
          r.summary_json.c_str(),
          {}};
}

int64_t h6GetRecordingFrames(h6Recording* recording, uint64_t first, h6FrameRecord* out,
                             size_t count, h6Error* error) {
  if (!recording || (count && !out))
    return fill(error, H6_ERROR_ARGUMENT, "a recording and room are needed"), -1;
  return guarded(error, std::int64_t{-1}, [&]() -> std::int64_t {
    Result<Recording> part = read_recording(recording->file, {first, count});
    if (!part) return fill(error, H6_ERROR_CONTENT, part.error()), -1;
    std::copy(part->frames.begin(), part->frames.end(), out);
    return static_cast<std::int64_t>(part->frames.size());
  });
}

bool h6GetRecordingBend(const h6Recording* recording, size_t bend, h6RecordingBend* out) {
  if (!recording || !out || bend >= recording->head.head.bends.size()) return false;
  const RecordedBend& found = recording->head.head.bends[bend];
  *out = {static_cast<std::int32_t>(found.body), found.name.c_str(), found.modes, {}};
  return true;
}

int64_t h6GetRecordingBends(h6Recording* recording, uint64_t first, double* out, size_t count,
                            h6Error* error) {
  if (!recording || (count && !out))
    return fill(error, H6_ERROR_ARGUMENT, "a recording and room are needed"), -1;
  return guarded(error, std::int64_t{-1}, [&]() -> std::int64_t {
    Result<Recording> part = read_recording(recording->file, {first, count});
    if (!part) return fill(error, H6_ERROR_CONTENT, part.error()), -1;
    if (modes_of(part->head.bends) != modes_of(recording->head.head.bends))
      return fill(error, H6_ERROR_CONTENT, "the recording was replaced since it was opened"), -1;
    std::copy(part->bends.begin(), part->bends.end(), out);
    return static_cast<std::int64_t>(part->frames.size());
  });
}

bool h6GetRecordingEvent(const h6Recording* recording, size_t event, h6RecordingEvent* out) {
  if (!recording || !out || event >= recording->head.events.size()) return false;
  const RecordingEvent& e = recording->head.events[event];
  *out = {e.time, e.what.c_str(), e.detail.c_str()};
  return true;
}

}  // extern "C"
