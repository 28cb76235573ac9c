// SPDX-License-Identifier: Apache-2.0
// export_command.cpp - hapsix export: recordings and fields in forms that other programs read.
//
//   hapsix export run.h5 -o run.csv [--contacts contacts.csv|contacts.h5] [--bends bends.csv]
//   hapsix export bay.vdb -o plain.vdb
//
// A recording holds no contacts; they are computed again to the bit, and a recording that cannot be
// replayed has none to export. Shapes of bodies that bend, which older recordings lack, are computed
// again likewise. 3,000 contacts of 17 numbers at 1 kHz would be 0.4 GB for each second of a run.
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
#include "io/record/columns_file.h"
#include "io/record/to_csv.h"
#include "io/run/recorded_session.h"
#include "io/view/replayed_contacts.h"

namespace h6::cli {
namespace {

constexpr std::uint64_t kPiece = 4096;

struct ExportOptions {
  std::string input, output, contacts, bends;
};

bool ends(const std::string& text, const std::string& ending) {
  return text.size() > ending.size() &&
         text.compare(text.size() - ending.size(), ending.size(), ending) == 0;
}

using Pieces = std::function<Outcome(const io::Recording&)>;

// Calls `use` with all frames of a recording, some thousand at a time.
Outcome each_piece(const std::string& file, std::uint64_t count, const Console& console,
                   const Pieces& use) {
  const io::Progress progress = console.progress();
  for (std::uint64_t at = 0; at < count; at += kPiece) {
    Result<io::Recording> piece = io::read_recording(file, {at, kPiece});
    if (!piece) return piece.failure();
    if (Outcome used = use(*piece); !used) return used;
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
    out << io::csv_head(head.head);
    Outcome all =
        each_piece(o.input, head.frame_count, console, [&](const io::Recording& piece) -> Outcome {
          std::string text;
          io::append_csv(piece, text);
          out << text;
          return out ? Outcome(Done{}) : flushed(out);
        });
    return all ? flushed(out) : all;
  });
}

// A contact's row. `body` and `with` are indices of the scene's bodies; `with` is their number
// where a contact is with none of them.
const std::vector<io::TableColumn>& contact_columns() {
  static const std::vector<io::TableColumn> columns = {{"t", "s"},
                                                       {"frame", "1", true},
                                                       {"body", "index into names", true},
                                                       {"point", "1", true},
                                                       {"x", "m"},
                                                       {"y", "m"},
                                                       {"z", "m"},
                                                       {"nx", "1"},
                                                       {"ny", "1"},
                                                       {"nz", "1"},
                                                       {"tx", "1"},
                                                       {"ty", "1"},
                                                       {"tz", "1"},
                                                       {"weight", "1"},
                                                       {"depth", "m"},
                                                       {"load", "m: force along the normal over k"},
                                                       {"with", "index into names", true}};
  return columns;
}

void add_contacts(const RecordedSession& session, const h6FrameRecord& frame,
                  std::vector<double>& rows) {
  const std::size_t bodies = session.loaded().bodies.size();
  for (const auto& c : io::view::replayed_contacts(session.loaded(), session.session())) {
    const io::view::ReportContact& r = c.contact;
    const auto& n = r.normal;
    const auto& t = r.torque_direction;
    rows.insert(rows.end(),
                {frame.time, static_cast<double>(frame.report.frame), static_cast<double>(c.body),
                 static_cast<double>(c.point), r.position[0], r.position[1], r.position[2], n[0],
                 n[1], n[2], t[0], t[1], t[2], r.weight, r.depth, c.load,
                 static_cast<double>(std::min<std::size_t>(c.with, bodies))});
  }
}

// The same row as text, with the bodies' names in the end.
void append_contacts(const RecordedSession& session, const h6FrameRecord& frame, std::string& out) {
  const auto& names = session.loaded().scene.bodies;
  const auto name = [&](double index) {
    const auto i = static_cast<std::size_t>(index);
    return io::csv_quoted(i < names.size() ? names[i].name : "");
  };
  const std::vector<io::TableColumn>& columns = contact_columns();
  std::vector<double> rows;
  add_contacts(session, frame, rows);
  for (std::size_t at = 0; at < rows.size(); at += columns.size()) {
    const double* const row = &rows[at];
    char text[32];
    for (std::size_t c = 0; c + 1 < columns.size(); ++c) {
      std::snprintf(text, sizeof text,
                    columns[c].whole ? "%.0f,"
                    : c == 0         ? "%.6f,"
                                     : "%.9g,",
                    row[c]);
      out += text;
    }
    out += name(row[2]) + ',' + name(row[columns.size() - 1]) + '\n';
  }
}

std::string contacts_head(const io::LoadedScene&) {
  std::string out;
  for (std::size_t c = 0; c + 1 < contact_columns().size(); ++c)
    out += contact_columns()[c].name + ',';
  return out + "part,with\n";
}

using Bends = std::vector<io::RecordedBend>;

std::size_t most_modes(const Bends& bends) {
  std::size_t most = 0;
  for (const io::RecordedBend& bend : bends) most = std::max(most, bend.modes);
  return most;
}

std::string bends_head(const Bends& bends) {
  std::string out = "t,frame,body";
  for (std::size_t j = 1; j <= most_modes(bends); ++j) out += ",q" + std::to_string(j);
  return out + '\n';
}

// A row for each body that bends; one with fewer modes than another has empty cells.
void append_bends(const Bends& bends, const double* q, const h6FrameRecord& frame,
                  std::string& out) {
  const std::size_t most = most_modes(bends);
  char text[64];
  for (const io::RecordedBend& bend : bends) {
    std::snprintf(text, sizeof text, "%.6f,%llu,", frame.time,
                  static_cast<unsigned long long>(frame.report.frame));
    out += text + io::csv_quoted(bend.name);
    for (std::size_t j = 0; j < most; ++j) {
      std::snprintf(text, sizeof text, ",%.17g", j < bend.modes ? *q++ : 0.0);
      out += j < bend.modes ? text : ",";
    }
    out += '\n';
  }
}

Outcome export_recorded_bends(const ExportOptions& o, const io::Recording& head,
                              const Console& console) {
  const Bends& bends = head.head.bends;
  return io::write_aside(o.bends, [&](const std::filesystem::path& path) -> Outcome {
    std::ofstream out(path, std::ios::binary);
    out << bends_head(bends);
    Outcome all =
        each_piece(o.input, head.frame_count, console, [&](const io::Recording& piece) -> Outcome {
          std::string text;
          for (std::size_t i = 0; i < piece.frames.size(); ++i)
            append_bends(bends, piece.bends.data() + i * io::modes_of(bends), piece.frames[i],
                         text);
          out << text;
          return out ? Outcome(Done{}) : flushed(out);
        });
    return all ? flushed(out) : all;
  });
}

// Those of a recording that lacks them. The first line is empty where nothing bends.
std::string computed_bends_head(const io::LoadedScene& scene) {
  const Bends bends = recorded_bends(scene);
  return bends.empty() ? "" : bends_head(bends);
}

void append_computed_bends(const RecordedSession& session, const h6FrameRecord& frame,
                           std::string& out) {
  append_bends(recorded_bends(session.loaded()), session.bends().data(), frame, out);
}

// A table that is made by stepping a recording again: its first line, and the rows of a frame.
struct Table {
  std::string (*head)(const io::LoadedScene&);
  void (*append)(const RecordedSession&, const h6FrameRecord&, std::string&);
};

// Steps a recording again and calls `each` after every frame, `piece` after some thousand.
Outcome step_again(RecordedSession& session, const std::string& input, std::uint64_t count,
                   const Console& console, const std::function<void(const h6FrameRecord&)>& each,
                   const std::function<Outcome()>& piece) {
  return each_piece(input, count, console, [&](const io::Recording& rows) -> Outcome {
    for (const h6FrameRecord& frame : rows.frames) {
      const auto stepped = session.step(frame);
      if (!stepped) return stepped.failure();
      each(**stepped);
    }
    return piece();
  });
}

Result<std::unique_ptr<RecordedSession>> open_again(const std::string& input,
                                                    const io::Recording& head,
                                                    const Console& console) {
  std::vector<std::string> remarks;
  Result<std::unique_ptr<RecordedSession>> session =
      RecordedSession::open(input, head, {}, console.progress(), remarks);
  console.warn(remarks);
  return session ? std::move(session) : Failure{"it cannot be replayed: " + session.error()};
}

Outcome export_again(const std::string& input, const std::string& output, const io::Recording& head,
                     const Console& console, const Table& table) {
  const Result<std::unique_ptr<RecordedSession>> session = open_again(input, head, console);
  if (!session) return session.failure();
  const std::string first_line = table.head((*session)->loaded());
  if (first_line.empty())
    return Failure{"nothing in its scene bends, so there is nothing to write to " + output};
  return io::write_aside(output, [&](const std::filesystem::path& path) -> Outcome {
    std::ofstream out(path, std::ios::binary);
    out << first_line;
    std::string text;
    Outcome all = step_again(
        **session, input, head.frame_count, console,
        [&](const h6FrameRecord& frame) { table.append(**session, frame, text); },
        [&]() -> Outcome {
          out << text;
          text.clear();
          return out ? Outcome(Done{}) : flushed(out);
        });
    return all ? flushed(out) : all;
  });
}

Outcome export_contacts_h5(const std::string& input, const std::string& output,
                           const io::Recording& head, const Console& console) {
  const Result<std::unique_ptr<RecordedSession>> session = open_again(input, head, console);
  if (!session) return session.failure();
  std::vector<std::string> names;
  for (const io::SceneBody& body : (*session)->loaded().scene.bodies) names.push_back(body.name);
  return io::write_aside(output, [&](const std::filesystem::path& path) -> Outcome {
    Result<std::unique_ptr<io::ColumnsFile>> out =
        io::ColumnsFile::create(path, contact_columns(), names);
    if (!out) return out.failure();
    std::vector<double> rows;
    Outcome all = step_again(
        **session, input, head.frame_count, console,
        [&](const h6FrameRecord& frame) { add_contacts(**session, frame, rows); },
        [&] {
          Outcome kept = (*out)->append(rows);
          rows.clear();
          return kept;
        });
    return all ? (*out)->close() : all;
  });
}

Outcome export_recording(const ExportOptions& o, const Console& console, std::uint64_t& frames) {
  Result<io::Recording> head = io::read_recording(o.input, {0, 0});
  if (!head) return head.failure();
  if (!head->remark.empty()) console.log(o.input + ": " + head->remark);
  frames = head->frame_count;
  // The frames come last, since a recording that cannot be replayed writes nothing then.
  if (!o.bends.empty()) {
    const Outcome done = head->head.bends.empty()
                             ? export_again(o.input, o.bends, *head, console,
                                            {computed_bends_head, append_computed_bends})
                             : export_recorded_bends(o, *head, console);
    if (!done) return done;
  }
  if (!o.contacts.empty()) {
    const Outcome done =
        ends(o.contacts, ".h5")
            ? export_contacts_h5(o.input, o.contacts, *head, console)
            : export_again(o.input, o.contacts, *head, console, {contacts_head, append_contacts});
    if (!done) return done;
  }
  return export_frames(o, *head, console);
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
  if (field && !(o.contacts.empty() && o.bends.empty()))
    return console.fail("--contacts and --bends are for recordings, and " + o.input + " is a field",
                        kUsage);
  if (Outcome there = field ? check_input(o.input) : check_recording(o.input); !there)
    return console.fail(there.error());
  for (const std::string& file : {o.output, o.contacts, o.bends})
    if (Outcome place = check_output(file); !file.empty() && !place)
      return console.fail(place.error());
  std::uint64_t frames = 0;
  const Outcome done = field ? export_field(o) : export_recording(o, console, frames);
  if (!done) return console.fail(o.input + ": " + done.error());
  nlohmann::ordered_json said{{"exported", o.output}};
  if (!field) said["frames"] = frames;
  if (!o.contacts.empty()) said["contacts"] = o.contacts;
  if (!o.bends.empty()) said["bends"] = o.bends;
  console.result(said);
  if (!console.json && field) std::printf("%s: one level set of floats\n", o.output.c_str());
  if (!console.json && !field)
    std::printf("%s: %llu frames%s%s%s%s\n", o.output.c_str(),
                static_cast<unsigned long long>(frames), o.contacts.empty() ? "" : ", contacts in ",
                o.contacts.c_str(), o.bends.empty() ? "" : ", shapes in ", o.bends.c_str());
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
      ->option_text("CONTACTS.csv|CONTACTS.h5")
      ->check([](const std::string& name) {
        const bool good = ends(name, ".csv") || ends(name, ".h5");
        return good ? std::string{} : must_be("a file name that ends in .csv or .h5", name);
      });
  command
      ->add_option("--bends", o->bends,
                   "The coordinates of every body that bends in every frame, computed again "
                   "[m sqrt(kg)]")
      ->option_text("BENDS.csv")
      ->check(ends_with(".csv"));
  command->callback([&program, o] {
    program.work = [&program, o] { return export_command(program.console, *o); };
  });
}

}  // namespace h6::cli
