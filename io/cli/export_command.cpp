// SPDX-License-Identifier: Apache-2.0
// export_command.cpp - hapsix export: recordings and fields in forms that other programs read.
//
//   hapsix export run.h5 -o run.csv [--contacts contacts.csv]
//   hapsix export bay.vdb -o plain.vdb
//
// A recording holds no contacts; they are computed again, and a recording that cannot be replayed
// has none to export.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/cli/commands.h"
#include "io/console/checks.h"
#include "io/field/field_file.h"
#include "io/file/csv.h"
#include "io/file/write_aside.h"
#include "io/record/to_csv.h"
#include "io/run/recorded_session.h"
#include "io/view/replayed_contacts.h"

namespace h6::cli {
namespace {

constexpr std::uint64_t kPiece = 4096;

struct ExportOptions {
  std::string input, output, contacts;
};

bool ends(const std::string& text, const std::string& ending) {
  return text.size() > ending.size() &&
         text.compare(text.size() - ending.size(), ending.size(), ending) == 0;
}

using Rows = std::function<Outcome(std::vector<h6FrameRecord>&)>;

// Calls `use` with all frames of a recording, some thousand at a time.
Outcome each_piece(const std::string& file, std::uint64_t count, const Console& console,
                   const Rows& use) {
  const io::Progress progress = console.progress();
  for (std::uint64_t at = 0; at < count; at += kPiece) {
    Result<io::Recording> piece = io::read_recording(file, {at, kPiece});
    if (!piece) return piece.failure();
    if (Outcome used = use(piece->frames); !used) return used;
    const std::uint64_t done = std::min(count, at + kPiece);
    if (progress && !progress("exporting", static_cast<double>(done) / static_cast<double>(count)))
      return Failure{"interrupted"};
  }
  return Done{};
}

Outcome flushed(std::ofstream& out) {
  out.flush();
  return out ? Outcome(Done{}) : Outcome(Failure{"it could not be written: is the disk full?"});
}

Outcome export_frames(const ExportOptions& o, const io::Recording& head, const Console& console) {
  return io::write_aside(o.output, [&](const std::filesystem::path& path) -> Outcome {
    std::ofstream out(path, std::ios::binary);
    out << io::csv_head(head.head.hands);
    Outcome all = each_piece(o.input, head.frame_count, console,
                             [&](std::vector<h6FrameRecord>& frames) -> Outcome {
                               std::string text;
                               io::append_csv(frames, head.head.hands, text);
                               out << text;
                               return out ? Outcome(Done{}) : flushed(out);
                             });
    return all ? flushed(out) : all;
  });
}

void append_contacts(const RecordedSession& session, const h6FrameRecord& frame, std::string& out) {
  const auto& bodies = session.loaded().bodies;
  const auto& names = session.loaded().scene.bodies;
  for (const auto& c : io::view::replayed_contacts(session.loaded(), session.session())) {
    const io::view::ReportContact& r = c.contact;
    char text[320];
    std::snprintf(text, sizeof text,
                  "%.6f,%llu,%zu,%u,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,",
                  frame.time, static_cast<unsigned long long>(frame.report.frame), c.body, c.point,
                  r.position[0], r.position[1], r.position[2], r.normal[0], r.normal[1],
                  r.normal[2], r.torque_direction[0], r.torque_direction[1], r.torque_direction[2],
                  r.weight, r.depth, c.load);
    out += text;
    out += io::csv_quoted(names[c.body].name) + ',' +
           io::csv_quoted(c.with < bodies.size() ? names[c.with].name : "") + '\n';
  }
}

Outcome export_contacts(const ExportOptions& o, const io::Recording& head, const Console& console) {
  std::vector<std::string> remarks;
  Result<std::unique_ptr<RecordedSession>> session =
      RecordedSession::open(o.input, head, {}, console.progress(), remarks);
  console.warn(remarks);
  if (!session) return Failure{"its contacts cannot be computed again: " + session.error()};
  return io::write_aside(o.contacts, [&](const std::filesystem::path& path) -> Outcome {
    std::ofstream out(path, std::ios::binary);
    out << "t,frame,body,point,x,y,z,nx,ny,nz,tx,ty,tz,weight,depth,load,part,with\n";
    Outcome all = each_piece(o.input, head.frame_count, console,
                             [&](std::vector<h6FrameRecord>& frames) -> Outcome {
                               std::string text;
                               for (const h6FrameRecord& frame : frames) {
                                 const auto stepped = (*session)->step(frame);
                                 if (!stepped) return stepped.failure();
                                 append_contacts(**session, **stepped, text);
                               }
                               out << text;
                               return out ? Outcome(Done{}) : flushed(out);
                             });
    return all ? flushed(out) : all;
  });
}

Outcome export_recording(const ExportOptions& o, const Console& console, std::uint64_t& frames) {
  Result<io::Recording> head = io::read_recording(o.input, {0, 0});
  if (!head) return head.failure();
  if (!head->remark.empty()) console.log(o.input + ": " + head->remark);
  frames = head->frame_count;
  if (Outcome written = export_frames(o, *head, console); !written) return written;
  return o.contacts.empty() ? Outcome(Done{}) : export_contacts(o, *head, console);
}

Outcome export_field(const ExportOptions& o) {
  const Result<io::FieldData> field = io::read_field(o.input);
  if (!field) return field.failure();
  return io::write_level_set(o.output, *field);
}

int export_command(const Console& console, const ExportOptions& o) {
  const bool field = ends(o.input, ".vdb");
  if (ends(o.output, ".mcap"))
    return console.fail(
        "MCAP is not written, since no library of Debian writes it: export to .csv, or read the "
        ".h5 with h5py and write it with the package 'mcap' of PyPI",
        kUsage);
  if (ends(o.output, field ? ".vdb" : ".csv") == false)
    return console.fail(field ? "a field is exported to a file that ends in .vdb"
                              : "a recording is exported to a file that ends in .csv",
                        kUsage);
  if (field && !o.contacts.empty())
    return console.fail("--contacts is for recordings, and " + o.input + " is a field", kUsage);
  if (Outcome there = field ? check_input(o.input) : check_recording(o.input); !there)
    return console.fail(there.error());
  for (const std::string& file : {o.output, o.contacts})
    if (Outcome place = check_output(file); !file.empty() && !place)
      return console.fail(place.error());
  std::uint64_t frames = 0;
  const Outcome done = field ? export_field(o) : export_recording(o, console, frames);
  if (!done) return console.fail(o.input + ": " + done.error());
  nlohmann::ordered_json said{{"exported", o.output}};
  if (!field) said["frames"] = frames;
  if (!o.contacts.empty()) said["contacts"] = o.contacts;
  console.result(said);
  if (!console.json && field) std::printf("%s: one level set of floats\n", o.output.c_str());
  if (!console.json && !field)
    std::printf("%s: %llu frames%s%s\n", o.output.c_str(), static_cast<unsigned long long>(frames),
                o.contacts.empty() ? "" : ", contacts in ", o.contacts.c_str());
  return kOk;
}

}  // namespace

void add_export(CLI::App& app, Program& program) {
  CLI::App* command =
      app.add_subcommand("export", "A recording as CSV, or a field as a plain level set");
  auto o = std::make_shared<ExportOptions>();
  command->add_option("FILE", o->input, "A recording (.h5) or a field (.vdb)")
      ->required()
      ->option_text("FILE");
  command
      ->add_option("-o,--output", o->output,
                   "Frames: a row each, all columns, SI units; or the field's distance as one "
                   "grid of floats, for programs that read no others")
      ->required()
      ->option_text("OUT.csv|OUT.vdb");
  command
      ->add_option("--contacts", o->contacts,
                   "Every contact of every frame, computed again: place, normal, torque "
                   "direction, weight, depth, load, parts")
      ->option_text("CONTACTS.csv")
      ->check(ends_with(".csv"));
  command->callback([&program, o] {
    program.work = [&program, o] { return export_command(program.console, *o); };
  });
}

}  // namespace h6::cli
