// SPDX-License-Identifier: Apache-2.0
// The shapes of bodies that bend, through the contract: recorded by a program, read back, refused.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "hapsix/io.h"
#include "tests/io/private_cache.h"

namespace {

// A generated scene, stepped along its path by the program itself.
struct Stepped {
  h6Error error{};
  h6Scene* scene = nullptr;
  h6Session* session = nullptr;
  h6SessionDef def{};
  std::vector<h6FrameRecord> rows;
  std::vector<double> bends;
  std::size_t modes = 0;
  std::string file;

  Stepped(const char* name, int frames) {
    scene = h6ReadScene(name, nullptr, &error);
    REQUIRE_MESSAGE(scene, error.message);
    h6GetSceneSession(scene, &def);
    session = h6CreateSession(h6GetSceneModel(scene), &def, &error);
    REQUIRE_MESSAGE(session, error.message);
    file = h6::test::private_cache.folder / (std::string(name) + ".h5");
    for (int i = 0; i < frames; ++i) {
      h6DeviceSample in;
      h6DeviceCommand out;
      REQUIRE(h6SampleScenePath(scene, 0, i / def.rate, &in));
      h6Step(session, &in, &out);
      h6GetRecord(session, &in, &out, &rows.emplace_back());
      for (std::size_t b = 0; b < def.body_count; ++b) append(static_cast<std::int32_t>(b));
    }
    modes = bends.size() / rows.size();
  }
  void append(std::int32_t body) {
    double q[H6_MAX_MODES];
    const std::size_t r = h6GetDeformation(session, body, q, nullptr, H6_MAX_MODES);
    bends.insert(bends.end(), q, q + r);
  }
  Stepped(const Stepped&) = delete;
  ~Stepped() {
    h6DestroySession(session), h6DestroyScene(scene);
    std::filesystem::remove(file);
  }
  h6Recorder* recorder() {
    h6RecorderDef what = h6DefaultRecorderDef();
    what.scene = scene;
    h6Recorder* made = h6CreateRecorder(file.c_str(), &what, &error);
    REQUIRE_MESSAGE(made, error.message);
    return made;
  }
};

}  // namespace

TEST_CASE("a program records shapes, and reads which bodies bend and how, to the bit") {
  Stepped run("clip-and-rod", 450);
  REQUIRE(run.modes > 0);
  h6Recorder* recorder = run.recorder();
  CHECK_FALSE(h6RecordFramesWithBends(recorder, run.rows.data(), 1, run.bends.data(), run.modes + 1,
                                      &run.error));
  CHECK(run.error.code == H6_ERROR_ARGUMENT);
  REQUIRE(h6RecordFramesWithBends(recorder, run.rows.data(), 400, run.bends.data(), run.modes,
                                  &run.error));
  REQUIRE(h6RecordFrames(recorder, &run.rows[400], 50, &run.error));
  REQUIRE(h6FinishRecorder(recorder, nullptr, &run.error));
  h6DestroyRecorder(recorder);

  h6Recording* recording = h6ReadRecording(run.file.c_str(), &run.error);
  REQUIRE_MESSAGE(recording, run.error.message);
  h6RecordingBend bend;
  std::size_t modes = 0, bodies = 0;
  for (; h6GetRecordingBend(recording, bodies, &bend); ++bodies) {
    modes += bend.modes;
    CHECK(h6GetDeformation(run.session, bend.body, nullptr, nullptr, 0) == bend.modes);
    CHECK(std::string(bend.name) == h6GetBodyName(run.scene, bend.body));
  }
  CHECK(bodies > 0);
  CHECK(modes == run.modes);
  std::vector<double> q(450 * modes);
  CHECK(h6GetRecordingBends(recording, 0, q.data(), 450, &run.error) == 450);
  bool moved = false;
  for (std::size_t k = 0; k < 400 * modes; ++k) {
    REQUIRE(q[k] == run.bends[k]);
    moved = moved || q[k] != 0;
  }
  CHECK(moved);
  for (std::size_t k = 400 * modes; k < q.size(); ++k) REQUIRE(std::isnan(q[k]));  // not known
  CHECK(h6GetRecordingBends(recording, 398, q.data(), 2, &run.error) == 2);
  for (std::size_t k = 0; k < 2 * modes; ++k) CHECK(q[k] == run.bends[398 * modes + k]);
  CHECK(h6GetRecordingBends(recording, 449, q.data(), 9, &run.error) == 1);
  CHECK(h6GetRecordingBends(recording, 0, nullptr, 1, &run.error) == -1);
  CHECK_FALSE(h6GetRecordingBend(recording, 0, nullptr));
  h6DestroyRecording(recording);
}

TEST_CASE("where nothing bends there are no shapes to record, and none to read") {
  Stepped run("box-on-wall", 3);
  CHECK(run.modes == 0);
  h6Recorder* recorder = run.recorder();
  const double q[] = {1, 2, 3};
  CHECK_FALSE(h6RecordFramesWithBends(recorder, run.rows.data(), 3, q, 1, &run.error));
  REQUIRE(h6RecordFramesWithBends(recorder, run.rows.data(), 3, nullptr, 0, &run.error));
  REQUIRE(h6FinishRecorder(recorder, nullptr, &run.error));
  h6DestroyRecorder(recorder);
  h6Recording* recording = h6ReadRecording(run.file.c_str(), &run.error);
  h6RecordingBend bend;
  CHECK_FALSE(h6GetRecordingBend(recording, 0, &bend));
  double none[1];
  CHECK(h6GetRecordingBends(recording, 0, none, 3, &run.error) == 3);
  h6DestroyRecording(recording);
}

// ---- wrong arguments

TEST_CASE("without a recorder or a recording there are no shapes, and nothing is written") {
  h6Error error{};
  CHECK_FALSE(h6RecordFramesWithBends(nullptr, nullptr, 0, nullptr, 0, &error));
  CHECK(error.code == H6_ERROR_ARGUMENT);
  CHECK(h6GetRecordingBends(nullptr, 0, nullptr, 0, &error) == -1);
  CHECK_FALSE(h6GetRecordingBend(nullptr, 0, nullptr));
}
