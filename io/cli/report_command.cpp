// SPDX-License-Identifier: Apache-2.0
// report_command.cpp - hapsix report REC.h5... -o OUT.html: writes recordings as one HTML file.
//
// Recordings hold the motion of devices and bodies. Their contacts are computed again by replaying
// each recorded hand. If that is no longer possible, the report says so and omits the contacts.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/cli/commands.h"
#include "io/cli/report_files.h"
#include "io/console/checks.h"
#include "io/file/write_aside.h"
#include "io/run/recorded_session.h"
#include "io/view/page.h"
#include "io/view/replayed_contacts.h"
#include "io/view/report.h"

namespace h6::cli {
namespace {

constexpr std::uint64_t kPiece = 4096;

constexpr std::size_t kMostRuns = 16;

struct ReportOptions {
  std::vector<std::string> files;
  std::string output;
};

class Reporter {
 public:
  explicit Reporter(const Console& console) : console_(console) {}

  Outcome add(const std::string& file) {
    io::FrameRange none;
    none.count = 0;
    Result<io::Recording> recording = io::read_recording(file, none);
    if (!recording) return recording.failure();
    if (!recording->remark.empty()) console_.log(file + ": " + recording->remark);
    if (recording->frame_count == 0) return Failure{"it has no frame"};
    std::vector<std::string> remarks;
    Result<std::unique_ptr<RecordedSession>> session =
        RecordedSession::open(file, *recording, {}, console_.progress(), remarks);
    if (!session) leave_out("contacts of " + file + " are missing: " + session.error());
    runs_.emplace_back(std::filesystem::path(file).stem().string(), recording->head,
                       recording->frame_count);
    io::view::ReportRun& run = runs_.back();
    Outcome read = frames(file, recording->frame_count, run, session ? session->get() : nullptr);
    if (!read) return read;
    run.events(std::move(recording->events), recording->summary_json);
    if (session && !session_) session_ = std::move(*session);
    return Done{};
  }

  Outcome write(const std::string& output) {
    const Result<std::string> html =
        io::view::make_report(runs_, session_ ? &session_->loaded() : nullptr, about_);
    if (!html) return html.failure();
    bytes = html->size();
    return io::write_text_aside(output, *html);
  }

  std::size_t bytes = 0;

 private:
  Outcome frames(const std::string& file, std::uint64_t count, io::view::ReportRun& run,
                 RecordedSession* session) {
    const io::Progress progress = console_.progress();
    const std::vector<std::uint64_t>& shown = run.replay_frames();
    std::size_t sample = 0;
    std::uint64_t done = 0;
    double deepest = 0;  // so far [voxel]
    for (std::uint64_t at = 0; at < count; at += kPiece) {
      Result<io::Recording> piece = io::read_recording(file, {at, kPiece});
      if (!piece) return piece.failure();
      for (h6FrameRecord& row : piece->frames) {
        if (session) {
          const auto stepped = session->step(row);
          if (stepped && (row.late & H6_LATE_COMPUTE))
            run.stepped_again(row.report.frame, (*stepped)->report.frame_us);
          if (stepped && row.inputs_only) row = **stepped;
          if (stepped && row.report.max_depth_voxels > deepest) {
            deepest = row.report.max_depth_voxels;
            note_tightest(*session, row.time, run);
          }
          if (!stepped) {
            leave_out("contacts of " + file + " end early: " + stepped.error());
            session = nullptr;
          }
        }
        if (sample < shown.size() && shown[sample] == done) {
          if (session) {
            std::vector<io::view::ReportContact> contacts;
            for (const auto& c : io::view::replayed_contacts(session->loaded(), session->session()))
              contacts.push_back(c.contact);
            run.contacts(sample, std::move(contacts));
            run.bend(sample, io::view::replayed_bends(session->loaded(), session->session()));
          }
          ++sample;
        }
        ++done;
      }
      run.add(piece->frames);
      if (!progress("reading " + file, static_cast<double>(done) / static_cast<double>(count)))
        return Failure{"interrupted"};
    }
    return Done{};
  }

  // The deepest contact of the frame that `session` was stepped to last.
  static void note_tightest(const RecordedSession& session, double time, io::view::ReportRun& run) {
    const io::LoadedScene& loaded = session.loaded();
    const auto all = io::view::replayed_contacts(loaded, session.session());
    const auto at = std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.contact.depth < b.contact.depth;
    });
    if (at == all.end()) return;
    const io::Unit unit = session.run().unit;
    const double metres = io::metres(unit);
    const auto& p = at->contact.position;
    run.tightest({time,
                  {p[0] / metres, p[1] / metres, p[2] / metres},
                  io::unit_name(unit),
                  loaded.scene.bodies[at->body].name,
                  loaded.scene.bodies[at->with].name});
  }

  void leave_out(const std::string& why) {
    console_.log("hapsix: " + why);
    about_ += (about_.empty() ? "" : "; ") + why;
  }

  const Console& console_;
  std::vector<io::view::ReportRun> runs_;
  std::unique_ptr<RecordedSession> session_;  // draws the bodies
  std::string about_;
};

int report_command(const Console& console, const ReportOptions& o) {
  if (o.files.size() > kMostRuns)
    return console.fail("a report draws up to " + std::to_string(kMostRuns) + " recordings, not " +
                            std::to_string(o.files.size()),
                        kUsage);
  if (io::view::report_page().empty()) return console.fail(io::view::no_page());
  for (const std::string& file : o.files)
    if (Outcome there = check_recording(file); !there) return console.fail(there.error());
  if (Outcome place = check_output(o.output); !place) return console.fail(place.error());
  const Result<std::size_t> bytes = write_report(o.files, o.output, console);
  if (!bytes) return console.fail(bytes.error());
  console.result({{"report", o.output}, {"recordings", o.files}, {"bytes", *bytes}});
  if (!console.json)
    std::printf("%s: %zu recording%s, %.1f MB; open it in a browser\n", printable(o.output).c_str(),
                o.files.size(), o.files.size() == 1 ? "" : "s", 1e-6 * static_cast<double>(*bytes));
  return kOk;
}

}  // namespace

Result<std::size_t> write_report(const std::vector<std::string>& recordings,
                                 const std::string& output, const Console& console) {
  Reporter reporter(console);
  for (const std::string& file : recordings)
    if (Outcome added = reporter.add(file); !added) return Failure{file + ": " + added.error()};
  if (Outcome written = reporter.write(output); !written) return written.failure();
  return reporter.bytes;
}

void add_report(CLI::App& app, Program& program) {
  CLI::App* report = app.add_subcommand("report", "Recordings as one HTML file to look at");
  auto o = std::make_shared<ReportOptions>();
  report
      ->add_option("REC", o->files,
                   "Recordings, made by 'hapsix run --record'; drawn over one another")
      ->required()
      ->option_text("REC.h5...")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->check(ends_with(".h5"));
  report->add_option("-o,--output", o->output, "The report")
      ->required()
      ->option_text("OUT.html")
      ->check(ends_with(".html"));
  report->callback([&program, o] {
    program.work = [&program, o] { return report_command(program.console, *o); };
  });
}

}  // namespace h6::cli
