// SPDX-License-Identifier: Apache-2.0
#include "io/view/trace.h"

#include <algorithm>
#include <cstdio>
#include <string>

#include "io/file/write_aside.h"

namespace h6::io::view {
namespace {

const char* late_name(std::uint32_t late) {
  if (late & H6_LATE_COMPUTE) return "late: own computation";
  if (late & H6_LATE_STOLEN) return "late: stolen";
  return "late: wake-up";
}

template <class... Values>
void print(std::string& to, const char* format, Values... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  to += text;
}

}  // namespace

void Trace::add(const h6FrameRecord* rows, std::size_t count) {
  for (std::size_t i = count > most_ ? count - most_ : 0; i < count; ++i) {
    const h6FrameRecord& r = rows[i];
    Row row{};
    row.time = r.time;
    row.wakeup_us = r.wakeup_us;
    row.frame_us = r.report.frame_us;
    std::copy_n(r.report.stage_us, H6_STAGE_COUNT, row.stage_us);
    row.depth_voxels = r.report.max_depth_voxels;
    row.helper_start_us = r.report.helper_start_us;
    row.helper_us = r.report.helper_us;
    row.helper_slices = r.report.helper_slices;
    row.frame = r.report.frame;
    row.contacts = r.report.contacts;
    row.late = r.late;
    row.status = r.report.status;
    if (rows_.size() == most_) rows_.pop_front();
    rows_.push_back(row);
  }
}

Outcome Trace::write(const std::filesystem::path& file) const {
  std::string text =
      "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n"
      "{\"ph\":\"M\",\"pid\":1,\"name\":\"process_name\",\"args\":{\"name\":\"hapsix\"}},\n"
      "{\"ph\":\"M\",\"pid\":1,\"tid\":1,\"name\":\"thread_name\",\"args\":{\"name\":\"haptic "
      "thread\"}},\n"
      "{\"ph\":\"M\",\"pid\":1,\"tid\":2,\"name\":\"thread_name\",\"args\":{\"name\":\"helper\"}}";
  for (const Row& r : rows_) {
    // In microseconds. A frame begins at its deadline, then the thread wakes up, then it works.
    const double deadline = 1e6 * r.time, start = deadline + std::max(0.0, r.wakeup_us);
    if (r.wakeup_us > 0)
      print(text,
            ",\n{\"ph\":\"X\",\"pid\":1,\"tid\":1,\"name\":\"wake-up\",\"ts\":%.3f,\"dur\":%.3f}",
            deadline, r.wakeup_us);
    print(text,
          ",\n{\"ph\":\"X\",\"pid\":1,\"tid\":1,\"name\":\"frame\",\"ts\":%.3f,\"dur\":%.3f,"
          "\"args\":{\"frame\":%llu,\"contacts\":%u,\"depth_voxels\":%.4f,\"status\":%u}}",
          start, r.frame_us, static_cast<unsigned long long>(r.frame), r.contacts, r.depth_voxels,
          static_cast<unsigned>(r.status));
    double stages = 0;
    for (const double us : r.stage_us) stages += us;
    // Time outside the stages (reading samples, hashing) is split evenly before and after them.
    double at = start + std::max(0.0, 0.5 * (r.frame_us - stages));
    for (int s = 0; s < H6_STAGE_COUNT; ++s) {
      print(text, ",\n{\"ph\":\"X\",\"pid\":1,\"tid\":1,\"name\":\"%s\",\"ts\":%.3f,\"dur\":%.3f}",
            h6StageName(static_cast<h6Stage>(s)), at, r.stage_us[s]);
      at += r.stage_us[s];
    }
    if (r.helper_slices)  // drawn without the waits between its slices
      print(text,
            ",\n{\"ph\":\"X\",\"pid\":1,\"tid\":2,\"name\":\"%u slices\",\"ts\":%.3f,\"dur\":%.3f}",
            r.helper_slices, start + r.helper_start_us, r.helper_us);
    if (r.late)
      print(text, ",\n{\"ph\":\"i\",\"s\":\"t\",\"pid\":1,\"tid\":1,\"name\":\"%s\",\"ts\":%.3f}",
            late_name(r.late), start + r.frame_us);
    print(text, ",\n{\"ph\":\"C\",\"pid\":1,\"name\":\"contacts\",\"ts\":%.3f,\"args\":{\"n\":%u}}",
          deadline, r.contacts);
    print(
        text,
        ",\n{\"ph\":\"C\",\"pid\":1,\"name\":\"depth [voxel]\",\"ts\":%.3f,\"args\":{\"d\":%.4f}}",
        deadline, r.depth_voxels);
  }
  text += "\n]}\n";
  return write_text_aside(file, text);
}

}  // namespace h6::io::view
