// SPDX-License-Identifier: Apache-2.0
// replay_command.cpp - hapsix replay REC.h5: runs the recorded hand again, in virtual time.
//
//   recording --head--> scene, settings, SIMD target --> session
//             --rows--> samples -> h6Step -> row <-- compared to the bit --> recorded row
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "io/cli/commands.h"
#include "io/console/checks.h"
#include "io/record/recording.h"
#include "io/record/seal.h"
#include "io/run/account.h"
#include "io/run/recorded_session.h"
#include "io/run/run_scene.h"
#include "io/run/run_tally.h"
#include "kernels/targets.h"

namespace h6::cli {
namespace {

using nlohmann::ordered_json;

struct ReplayOptions {
  std::string file, method;
  unsigned threads = 0;  // 0: as recorded
  bool verify = false;
};

struct Divergence {
  std::uint64_t frame;
  double time;
  std::optional<io::RowDifference> where;  // nothing: only the seal differs
  std::uint64_t recorded_hash, replayed_hash;
};

std::string hex(std::uint64_t value) {
  char text[20];
  std::snprintf(text, sizeof text, "%016" PRIx64, value);
  return text;
}

// Figures for a person who compares two runs.
struct Figures {
  RunTally tally;
  RunTotals totals;        // after judge()
  std::uint64_t hash = 0;  // a hash of all state hashes, in order

  Figures(const io::LoadedScene& loaded, double rate, double duration)
      : tally(loaded, rate, duration) {}

  void add(const h6FrameRecord& r) {
    tally.frame(r);
    hash = (hash ^ r.report.state_hash) * 0xd6e8feb86659fd93u;
    hash ^= hash >> 32;
  }
  void judge(const io::Progress& progress) { totals = tally.totals(progress); }
  ordered_json json() const {
    const Histogram& frame_us = tally.times().frame_us;
    return {{"contacts", {{"mean", totals.contacts_mean}, {"max", totals.contacts_max}}},
            {"max_depth_voxels", totals.max_depth_voxels},
            {"max_force", totals.max_force},
            {"max_torque", totals.max_torque},
            {"verdict", io::verdict_name(totals.verdict)},
            {"remarks", remarks(totals)},
            {"frame_us",
             {{"p50", frame_us.percentile(50)},
              {"p99", frame_us.percentile(99)},
              {"max", frame_us.max()}}},
            {"hash", hex(hash)}};
  }
  void print(const char* name, const std::string& method) const {
    const Histogram& frame_us = tally.times().frame_us;
    std::printf("%-9s %-14s %-9s %8.1f %6u %8.3f %8.2f %8.1f %8.1f\n", name, method.c_str(),
                io::verdict_name(totals.verdict), totals.contacts_mean, totals.contacts_max,
                totals.max_depth_voxels, totals.max_force, frame_us.percentile(50),
                frame_us.percentile(99));
  }
};

class Replay {
 public:
  Replay(const Console& console, const ReplayOptions& options)
      : console_(console), options_(options) {}

  Outcome open() {
    io::FrameRange none;
    none.count = 0;
    Result<io::Recording> recording = io::read_recording(options_.file, none);
    if (!recording) return recording.failure();
    recording_ = std::move(*recording);
    head_ = recording_.head;
    columns_ = recording_.columns;
    sealed_ = std::find(columns_.begin(), columns_.end(), "seal") != columns_.end();
    seal_.emplace(head_, columns_);
    comparison_.emplace(head_, columns_);
    frames_ = recording_.frame_count;
    if (!recording_.remark.empty()) remarks.push_back(recording_.remark);
    Result<std::unique_ptr<RecordedSession>> opened =
        RecordedSession::open(options_.file, recording_, {options_.method, options_.threads},
                              console_.progress(), remarks);
    if (!opened && !recording_.unsealed.empty())
      return Failure{opened.error() + "; " + recording_.unsealed +
                     " was changed after it was recorded"};
    if (!opened) return opened.failure();
    session_ = std::move(*opened);
    if (options_.verify)
      account_.emplace(session_->loaded(), recording_, session_->run().virtual_time);
    return Done{};
  }

  // Runs frame after frame. `as_recorded` gets the recorded rows, `now` the new ones.
  Outcome play() {
    const double duration = static_cast<double>(frames_) / head_.rate;
    recorded_.emplace(session_->loaded(), head_.rate, duration);
    replayed_.emplace(session_->loaded(), head_.rate, duration);
    const io::Progress progress = console_.progress();
    std::uint64_t expected = 0;
    for (std::uint64_t at = 0; at < frames_ && !divergence; at += kPiece) {
      const Result<io::Recording> piece = io::read_recording(options_.file, {at, kPiece});
      if (!piece) return piece.failure();
      for (std::size_t i = 0; i < piece->frames.size(); ++i) {
        const h6FrameRecord& row = piece->frames[i];
        if (row.report.frame != expected) return gap(expected, row.report.frame);
        ++expected;
        const Result<const h6FrameRecord*> now = session_->step(row);
        if (!now) return now.failure();
        short_ += row.inputs_only != 0;
        if (!row.inputs_only) recorded_->add(row), replayed_->add(**now);
        note_late(row, **now);
        if (!options_.verify) continue;
        account_->row(row);
        const double* q = piece->bends.data() + i * io::modes_of(head_.bends);
        const std::uint64_t seal = seal_->next(row, q);
        if (!same(row, q, **now, !sealed_ || piece->seals[i] == seal)) break;
      }
      if (!progress("replaying " + session_->loaded().scene.name,
                    static_cast<double>(expected) / static_cast<double>(frames_)))
        return Failure{"interrupted after " + std::to_string(expected) + " frames"};
    }
    recorded_->judge(progress);
    replayed_->judge(progress);
    if (!options_.verify || divergence) return Done{};
    changed = recording_.unsealed;
    reason_ = "does not fit its seal";
    if (!changed.empty()) return Done{};
    changed = account_->first_difference(progress);
    reason_ = "does not follow from the frames";
    if (interrupted.load()) return Failure{"interrupted while the summary was compared"};
    return changed.empty() ? compare_attributes() : Done{};
  }

  ordered_json json() const {
    ordered_json out{
        {"recording", options_.file},
        {"scene", session_->loaded().scene.name},
        {"recorded_method", session_->recorded_method()},
        {"method", session_->method()},
        {"threads", session_->threads()},
        {"frames", replayed_->totals.frames + short_},
        {"seconds", static_cast<double>(replayed_->totals.frames + short_) / head_.rate},
        {"late_by_clock", late_},
        {"late_again", late_again_},
        {"late_again_most_us", late_most_us_},
        {"recorded_simd_target", head_.simd_target},
        {"simd_target", kernels::target_name()},
        {"recorded_in_virtual_time", session_->run().virtual_time},
        {"remarks", remarks},
        {"recorded", recorded_->json()},
        {"replayed", replayed_->json()}};
    if (!options_.verify) return out;
    out["same"] = !divergence && changed.empty();
    out["sealed"] = sealed_ && recording_.sealed;
    out["compared"] = replayed_->totals.frames;  // the rest had only inputs
    out["changed"] = changed.empty() ? ordered_json() : ordered_json(changed);
    out["divergence"] = nullptr;
    if (divergence) {
      const io::RowDifference d =
          divergence->where.value_or(io::RowDifference{"seal", "seal", 0, 0, 0});
      out["divergence"] = {{"frame", divergence->frame},
                           {"time", divergence->time},
                           {"column", d.column},
                           {"cell", d.cell},
                           {"hand", d.hand},
                           {"recorded", d.a},
                           {"replayed", d.b},
                           {"recorded_hash", hex(divergence->recorded_hash)},
                           {"replayed_hash", hex(divergence->replayed_hash)}};
    }
    return out;
  }

  void print() const {
    std::printf("%-9s %-14s %-9s %8s %6s %8s %8s %8s %8s\n", "", "method", "verdict", "contacts",
                "most", "deepest", "force", "p50", "p99");
    std::printf("%-9s %-14s %-9s %8s %6s %8s %8s %8s %8s\n", "", "", "", "mean", "", "[voxel]",
                "[N]", "[us]", "[us]");
    recorded_->print("recorded", session_->recorded_method());
    replayed_->print("replayed", session_->method());
    if (late_ > 0) std::printf("\n%s\n", late_sentence().c_str());
    if (options_.verify && good())
      std::printf(
          "\nevery one of %" PRIu64
          " frames is the same to the bit: %s on %u thread%s\n%s"
          "computed again: contacts, depths, stiffness, poses, velocities, %scommands, causes, "
          "states, status, events, the summary's figures; attributes against what they repeat\n"
          "%s: scene, the hand's samples, "
          "deadlines, measured times, notes\n",
          replayed_->totals.frames, kernels::target_name(), session_->threads(),
          session_->threads() == 1 ? "" : "s", short_sentence().c_str(),
          head_.bends.empty() ? "" : "shapes where they are known, ",
          sealed_ && recording_.sealed ? "sealed, and unchanged since"
                                       : "neither computed nor sealed (an older file)");
  }

  bool good() const { return !divergence && changed.empty(); }

  // Describes the divergence in a sentence.
  std::string sentence() const {
    if (!divergence) return changed + " was changed after it was recorded: it " + reason_;
    if (!divergence->where)
      return "frame " + std::to_string(divergence->frame) + " (" + number(divergence->time, 4) +
             " s) was changed after it was recorded: its seal does not fit, while all that can be "
             "computed again is the same, so a sample of the hand, a deadline or a measured time "
             "differs";
    const io::RowDifference& d = *divergence->where;
    char text[400];
    std::snprintf(
        text, sizeof text,
        "frame %" PRIu64 " (%.4f s) is not what was recorded: %s%s%s is %.17g, it was %.17g",
        divergence->frame, divergence->time, d.column.c_str(), d.cell == d.column ? "" : " ",
        d.cell == d.column ? "" : d.cell.c_str(), d.b, d.a);
    std::string out = text;
    if (d.column == "hash")
      out = "frame " + std::to_string(divergence->frame) + " (" + number(divergence->time, 4) +
            " s) is not what was recorded: its hash differs while all that a hand holds is the "
            "same, so the hand's sample or another body differs";
    if (head_.simd_target != kernels::target_name())
      out += "; it was recorded on " + head_.simd_target + ", this is " + kernels::target_name();
    return out;
  }

  std::vector<std::string> remarks;
  std::optional<Divergence> divergence;
  std::string changed;  // what else was changed: the head, an event, the summary

 private:
  static constexpr std::uint64_t kPiece = 4096;

  // `q`: of all bodies that bend, as recorded.
  bool same(const h6FrameRecord& row, const double* q, const h6FrameRecord& now, bool seal_fits) {
    const auto where =
        row.inputs_only ? std::nullopt : comparison_->first(row, q, now, session_->bends().data());
    if (!where && seal_fits) return true;
    divergence =
        Divergence{row.report.frame, row.time, where, row.report.state_hash, now.report.state_hash};
    return false;
  }

  Outcome compare_attributes() {
    Result<std::string> attribute = io::first_changed_attribute(options_.file, recording_);
    if (!attribute) return attribute.failure();
    changed = *attribute;
    reason_ = "is not what the recording says elsewhere";
    return Done{};
  }

  Outcome gap(std::uint64_t expected, std::uint64_t found) {
    if (expected == 0)
      return Failure{"it begins with frame " + std::to_string(found) +
                     ": a run can only be replayed from its first frame on"};
    return Failure{"frames " + std::to_string(expected) + " to " + std::to_string(found - 1) +
                   " are missing, the recorder was too slow for them: up to there " +
                   (options_.verify ? "every frame is the same" : "it was replayed")};
  }

  // A frame that was late by its own CPU clock is computed once more here.
  void note_late(const h6FrameRecord& row, const h6FrameRecord& now) {
    if (!(row.late & H6_LATE_COMPUTE)) return;
    ++late_;
    late_again_ += now.report.frame_us > 1e6 / head_.rate;
    late_most_us_ = std::max(late_most_us_, now.report.frame_us);
  }

  std::string late_sentence() const {
    return std::to_string(late_) + " frames were late by the thread's own clock; computed again, " +
           std::to_string(late_again_) + " of them took over a period, and the dearest " +
           number(late_most_us_, 4) + " us" +
           (late_again_ < late_ ? ": the machine made the others late, if it is this one" : "");
  }

  std::string short_sentence() const {
    return short_ == 0 ? ""
                       : std::to_string(short_) +
                             " more were computed and not compared: the recorder was too slow and "
                             "kept only their inputs\n";
  }

  const Console& console_;
  const ReplayOptions& options_;
  io::Recording recording_;  // without its frames
  io::RecordingHead head_;
  std::uint64_t frames_ = 0;
  std::vector<std::string> columns_;         // in the file
  std::uint64_t short_ = 0;                  // frames so far of which the recording has only inputs
  std::uint64_t late_ = 0, late_again_ = 0;  // frames late by their own clock; again over a period
  double late_most_us_ = 0;
  const char* reason_ = "";  // of `changed`
  bool sealed_ = false;
  std::optional<io::RowSeal> seal_;
  std::optional<io::RowComparison> comparison_;
  std::optional<Account> account_;
  std::unique_ptr<RecordedSession> session_;
  std::optional<Figures> recorded_, replayed_;
};

int replay_command(const Console& console, const ReplayOptions& options) {
  RunOptions method;
  method.method = options.method;
  if (Outcome known = check_options(method); !known) return console.fail(known.error(), kUsage);
  if (options.verify && !options.method.empty())
    return console.fail("--verify compares bits with the recorded method: leave --method out",
                        kUsage);
  if (Outcome there = check_recording(options.file); !there) return console.fail(there.error());
  Replay replay(console, options);
  const auto failed = [&](const std::string& sentence) {
    console.warn(replay.remarks);
    return console.fail(options.file + " cannot be replayed: " + sentence);
  };
  if (Outcome opened = replay.open(); !opened) return failed(opened.error());
  if (Outcome played = replay.play(); !played) return failed(played.error());
  console.warn(replay.remarks);
  ordered_json json = replay.json();
  if (!replay.good()) json["error"] = replay.sentence();
  console.result(json);
  if (!console.json) replay.print();
  if (replay.good()) return kOk;
  console.log("hapsix: " + replay.sentence());
  return kFailed;
}

}  // namespace

void add_replay(CLI::App& app, Program& program) {
  CLI::App* replay =
      app.add_subcommand("replay", "Run a recorded hand again, and compare every bit");
  auto o = std::make_shared<ReplayOptions>();
  replay->add_option("REC", o->file, "A recording, made by 'hapsix run --record'")
      ->required()
      ->option_text("REC.h5")
      ->check(ends_with(".h5"));
  replay->add_option("--method", o->method, "Another way to share contact stiffness, same hand")
      ->option_text("NAME");
  replay->add_option("--threads", o->threads, "Default: as recorded")
      ->option_text("N")
      ->check(whole_within(1, 64));
  replay->add_flag(
      "--verify", o->verify,
      "Compute every number of every frame again, and check the seal of the others; exit 1 at "
      "the first frame that differs");
  replay->callback([&program, o] {
    program.work = [&program, o] { return replay_command(program.console, *o); };
  });
}

}  // namespace h6::cli
