// SPDX-License-Identifier: Apache-2.0
// A recording holds the settings that a user changes in the live view. Replay changes them before
// the same frame, or says why the recording does not allow that.
#include <doctest/doctest.h>
#include <hdf5.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "io/run/recorded_session.h"
#include "io/run/run_setup.h"
#include "io/scenes/scenes.h"
#include "tests/io/load.h"

using namespace h6;
using namespace h6::cli;

namespace {

namespace fs = std::filesystem;

const io::LoadedScene& pressed_box() {
  static const auto loaded = h6::test::load(*io::make_scene("box-on-wall"));
  return *loaded;
}

// Records a run as the live view does, with other settings after 300, 600 and 601 frames.
fs::path recorded(const std::string& name, bool tell = true) {
  RunSetup run(pressed_box());
  run.record = h6::test::private_cache.folder / name;
  const Outcome opened = run.open();
  if (!opened) FAIL(opened.error());
  std::uint32_t settings = 0;
  double time = 0;
  for (int i = 0; i < 900; ++i) {
    if (i == 300 || i == 600 || i == 601) {
      h6ContactDef& contact = run.def.contact;
      h6CouplingDef& coupling = run.hand_defs[0].coupling;
      contact.stiffness = 1e4 / (3 + settings);
      if (i == 600) contact.method = H6_METHOD_GAUSS6, contact.pieces = H6_PIECE_FACING;
      contact.epsilon = 0.1 / 3, contact.epsilon_normal = 0.7 / 3;
      coupling.max_depth_voxels = 1.0 / 3, coupling.max_force = coupling.max_torque = 0;
      SessionPtr next(h6CreateSession(run.loaded.model.get(), &run.def, nullptr));
      REQUIRE(next);
      REQUIRE(h6TakeOver(next.get(), run.session.get(), nullptr));
      run.session = std::move(next);
      ++settings;
      const std::string text = io::settings_text(contact, coupling);
      if (tell || settings < 3)
        REQUIRE(run.recorder->event({time, "settings", "after frame 299: " + text}));
    }
    h6FrameRecord row{};
    row.time = time = i * (1 / run.def.rate);
    row.settings = settings;
    REQUIRE(run.step(row));
    REQUIRE(run.recorder->frames(&row, 1));
  }
  REQUIRE(run.recorder->finish("{}"));
  return run.record;
}

struct Replayed {
  std::size_t frames = 0;  // number of frames that agree
  std::string stopped;     // the error sentence, if any
};

Replayed replay(const fs::path& file, const std::string& method = "") {
  const Result<io::Recording> recording = io::read_recording(file);
  if (!recording) FAIL(recording.error());
  std::vector<std::string> remarks;
  auto session = RecordedSession::open(file, *recording, {method, 0}, {}, remarks);
  if (!session) FAIL(session.error());
  Replayed out;
  const io::RowComparison compared(recording->head, recording->columns);
  for (const h6FrameRecord& row : recording->frames) {
    const auto now = (*session)->step(row);
    if (!now) return out.stopped = now.error(), out;
    if (method.empty() && compared.first(row, nullptr, **now, nullptr)) return out;
    ++out.frames;
  }
  return out;
}

}  // namespace

TEST_CASE("settings changed on the way are changed again, to the bit") {
  const fs::path file = recorded("run.h5");
  CHECK(replay(file).frames == 900);
  // If the caller chooses the method, the other settings still change.
  CHECK(replay(file, "none").frames == 900);
}

TEST_CASE("without the event, or the column that says when, a sentence ends the replay") {
  const Replayed untold = replay(recorded("untold.h5", false));
  CHECK(untold.frames == 601);
  CHECK(untold.stopped.find("frame 601: its settings were changed") != std::string::npos);
  CHECK(untold.stopped.find("missing") != std::string::npos);

  const fs::path file = recorded("older.h5");
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  REQUIRE(H5Ldelete(h5, "/frames/settings", H5P_DEFAULT) >= 0);
  H5Fclose(h5);
  const Replayed older = replay(file);
  CHECK(older.frames == 300);
  CHECK(older.stopped.find("did not say in which frame") != std::string::npos);
}

TEST_CASE("settings come back to the bit, and nonsense in their place is a sentence") {
  h6ContactDef contact = h6DefaultContactDef(), back = h6DefaultContactDef();
  h6CouplingDef coupling = h6DefaultCouplingDef(), held = h6DefaultCouplingDef();
  contact.method = H6_METHOD_GAUSS6, contact.pieces = H6_PIECE_PRODUCT | H6_PIECE_DEPTH;
  contact.stiffness = 1e5 / 7, contact.epsilon = 1.0 / 3, contact.epsilon_torque = 1e-300;
  coupling.max_depth_voxels = 0.1, coupling.max_torque = 1.0 / 9;
  coupling.stiffness = 1e4 / 3, coupling.rotational_stiffness = 1.0 / 7;
  const std::string text = io::settings_text(contact, coupling);
  CHECK(text.size() < 400);  // a recording cuts the detail of an event after 512 bytes
  REQUIRE(io::take_settings("after frame 12: " + text, back, held));
  CHECK(std::memcmp(&back, &contact, sizeof back) == 0);
  CHECK(std::memcmp(&held, &coupling, sizeof held) == 0);
  for (const char* wrong :
       {"", "method robust", "{", "{}", R"({"method": 3})", R"({"method": "nose"})"}) {
    CAPTURE(wrong);
    CHECK_FALSE(io::take_settings(wrong, back, held));
    CHECK(std::memcmp(&back, &contact, sizeof back) == 0);
  }
  // As older recordings have it: nobody could change the hand's stiffness then.
  std::string older = text;
  const std::size_t at = older.find("\"hand_"), end = older.find("\"max_depth");
  older.erase(at, end - at);
  CHECK(io::take_settings(older, back, held));
  CHECK(held.stiffness == coupling.stiffness);
  for (std::size_t cut = 0; cut < text.size(); cut += 7)
    CHECK_FALSE(io::take_settings(text.substr(0, cut), back, held));
}
