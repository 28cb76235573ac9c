// SPDX-License-Identifier: Apache-2.0
#include "io/run/account.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "io/console/console.h"

namespace h6::cli {
namespace {

using nlohmann::ordered_json;

// Figures of the summary that follow from the rows.
constexpr const char* kFigures[] = {"contacts",   "max_depth_voxels", "verdict",   "pop_through",
                                    "forbidden",  "remarks",          "frame_us",  "stage_us",
                                    "wakeup_us",  "final_pose",       "hand_pose", "max_force",
                                    "max_torque", "net_stiffness",    "state_hash"};

// Whether the rows do not tell of an event.
bool given(const io::RecordingEvent& event) {
  return event.what == "interrupted" || event.what == "overlap" ||
         event.detail.rfind("after frame ", 0) == 0;
}

// Whether the user had no time for the search of points that passed through.
bool search_was_interrupted(const io::Recording& recording) {
  const ordered_json said = ordered_json::parse(recording.summary_json, nullptr, false);
  const auto through = said.find("pop_through");
  return through != said.end() && through->is_object() &&
         through->value("interrupted", ordered_json()) == true;
}

bool same(const io::RecordingEvent& recorded, const io::RecordingEvent& again) {
  return recorded.time == again.time && again.what.rfind(recorded.what, 0) == 0 &&
         again.detail.rfind(recorded.detail, 0) == 0 &&
         (recorded.detail.size() == again.detail.size() || recorded.detail.size() > 500);
}

}  // namespace

Account::Account(const io::LoadedScene& loaded, const io::Recording& recording, bool virtual_time)
    : loaded_(loaded),
      recording_(recording),
      virtual_time_(virtual_time),
      watch_(
          (again_.seconds = static_cast<double>(std::max<std::uint64_t>(1, recording.frame_count)) /
                            recording.head.rate,
           loaded),
          recording.head.rate, again_, nullptr) {}

std::string Account::first_difference(const io::Progress& progress) {
  const io::Progress never = [](const std::string&, double) { return false; };
  // A run that was killed has not judged its last frames.
  if (recording_.whole) watch_.finish(search_was_interrupted(recording_) ? never : progress);
  const std::string event = event_difference();
  return !event.empty() || !recording_.whole ? event : summary_difference();
}

std::string Account::event_difference() const {
  const auto& recorded = recording_.events;
  std::size_t at = 0;
  for (const io::RecordingEvent& again : again_.events) {
    while (at < recorded.size() && given(recorded[at])) ++at;
    if (at == recorded.size()) return "event " + std::to_string(at) + " (" + again.what + ")";
    if (!same(recorded[at], again))
      return "event " + std::to_string(at) + " (" + recorded[at].what + ")";
    ++at;
  }
  // Events of a killed run reach the disk before their rows, and only so many are made again.
  if (!recording_.whole || again_.events_dropped > 0) return "";
  while (at < recorded.size() && given(recorded[at])) ++at;
  return at == recorded.size() ? ""
                               : "event " + std::to_string(at) + " (" + recorded[at].what + ")";
}

std::string Account::summary_difference() const {
  const ordered_json said = ordered_json::parse(recording_.summary_json, nullptr, false);
  const ordered_json now =
      ordered_json::parse(Console::text(to_json(again_, loaded_, virtual_time_)));
  for (const char* key : kFigures)
    if (said.contains(key) && said[key] != now.value(key, ordered_json()))
      return std::string(key) + " of its summary";
  return "";
}

}  // namespace h6::cli
