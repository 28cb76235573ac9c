// SPDX-License-Identifier: Apache-2.0
// run_setup.cpp - sets up a run of a loaded scene.
#include "io/run/run_setup.h"

#include "io/run/recorded_run.h"
#include "kernels/targets.h"

namespace h6::cli {

std::vector<io::RecordedBend> recorded_bends(const io::LoadedScene& loaded) {
  std::vector<io::RecordedBend> bends;
  for (std::size_t b = 0; b < loaded.bends.size(); ++b)
    if (loaded.bends[b])
      bends.push_back(
          {static_cast<std::uint32_t>(b), loaded.scene.bodies[b].name, loaded.bends[b]->modes});
  return bends;
}

void append_bends(const h6Session* session, const std::vector<io::RecordedBend>& bends,
                  std::vector<double>& out) {
  for (const io::RecordedBend& bend : bends) {
    const std::size_t end = out.size();
    out.resize(end + bend.modes);
    h6GetDeformation(session, static_cast<std::int32_t>(bend.body), out.data() + end, nullptr,
                     bend.modes);
  }
}

RunSetup::RunSetup(const io::LoadedScene& scene)
    : loaded(scene), def(scene.session_def()), hand_defs(scene.hands), hands(scene.scene.hands) {
  def.hands = hand_defs.data();
}

Outcome RunSetup::open() {
  h6Error error{};
  for (std::size_t i = 0; i < hands.size(); ++i) {  // a simulated arm knows its delay
    if (hands[i].device != "arm" || !hands[i].arm || hand_defs[i].delay_frames > 0) continue;
    hand_defs[i].delay_frames = static_cast<std::uint32_t>(hands[i].arm->delay_frames);
    hand_defs[i].delay_known = true;
  }
  session.reset(h6CreateSession(loaded.model.get(), &def, &error));
  if (!session) return Failure{error.message};
  overlaps = start_overlaps(loaded, def.contact, session.get());
  if (Outcome good = check_start(overlaps, loaded.scene.unit); !good) return good;
  for (std::size_t i = 0; i < hands.size(); ++i) hands[i].def = hand_defs[i];
  Result<Hands> opened = open_hands(loaded, hands, session.get(), steering);
  if (!opened) return opened.failure();
  devices = std::move(*opened);
  return record.empty() ? Outcome(Done{}) : open_recording();
}

Outcome RunSetup::step(h6FrameRecord& r) {
  bool good = true;
  for (std::size_t h = 0; h < devices.devices.size(); ++h) {
    const h6Device& device = devices.devices[h];
    good = device.read(device.self, r.time, &r.hand[h]) == 0 && good;
  }
  h6Step(session.get(), r.hand, r.command);
  for (std::size_t h = 0; h < devices.devices.size(); ++h) {
    const h6Device& device = devices.devices[h];
    good = device.write(device.self, r.time, &r.command[h]) == 0 && good;
    const auto hand = static_cast<std::int32_t>(h);
    r.body[h] = h6GetBody(session.get(), hand_defs[h].body);
    h6HandSafety safety;
    h6GetSafety(session.get(), hand, &safety);
    r.state[h] = safety.state;
    r.safety_input[h] = h6GetSafetyInput(session.get(), hand);
  }
  r.report = h6GetFrame(session.get());
  return good ? Outcome(Done{}) : Outcome(Failure{"a device was lost"});
}

// The recording holds the scene with the settings of this run, which may differ from the loaded
// ones.
Outcome RunSetup::open_recording() {
  io::Scene scene = loaded.scene;
  scene.contact = def.contact;
  if (!hand_defs.empty()) scene.coupling = hand_defs[0].coupling;
  scene.integrator = def.integrator;
  scene.gradient = def.gradient;
  scene.rate = def.rate;
  scene.max_substeps = def.max_substeps;
  scene.net_stiffness = def.net_stiffness;
  scene.hands = hands;
  io::RecordedRun how;
  how.generated = scene.generated;
  std::error_code ignored;
  if (!scene.file.empty()) how.scene_file = std::filesystem::absolute(scene.file, ignored);
  how.unit = scene.unit;
  how.threads = def.threads;
  how.virtual_time = virtual_time;
  how.max_contacts = def.max_contacts;
  how.max_pairs = def.max_pairs;
  how.frame_budget_us = def.frame_budget_us;
  how.gravity = def.gravity;
  how.bodies.assign(def.bodies, def.bodies + def.body_count);
  for (const h6Device& device : devices.devices) how.ratings.push_back(device.capabilities);
  io::RecordingHead head;
  head.scene_json = io::recorded_scene_text(scene);
  head.run_json = io::run_text(how);
  for (const io::LoadedAsset& a : loaded.assets) head.asset_hashes.push_back(a.hash);
  head.simd_target = kernels::target_name();
  head.rate = def.rate;
  head.hands = def.hand_count;
  head.bends = recorded_bends(loaded);
  head.program = "hapsix " + std::to_string(H6_VERSION_MAJOR) + "." +
                 std::to_string(H6_VERSION_MINOR) + "." + std::to_string(H6_VERSION_PATCH);
  Result<std::unique_ptr<io::Recorder>> created = io::Recorder::create(record, head);
  if (!created) return created.failure();
  recorder = std::move(*created);
  return Done{};
}

}  // namespace h6::cli
