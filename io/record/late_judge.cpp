// SPDX-License-Identifier: Apache-2.0
#include "io/record/late_judge.h"

#include <algorithm>
#include <cstdio>

namespace h6::io {
namespace {

constexpr std::size_t kEnough = 8;  // neighbours

}  // namespace

const char* late_cause_name(LateCause cause) {
  static constexpr const char* names[] = {"own computation", "the machine",
                                          "own computation or the machine", "stolen", "wake-up"};
  return names[static_cast<std::size_t>(cause)];
}

std::string LateFrame::sentence() const {
  char text[320];
  int n = std::snprintf(text, sizeof text,
                        "frame %llu ended %.0f us after its deadline: began %.0f us late, used "
                        "%.0f us",
                        static_cast<unsigned long long>(frame), late_us, wakeup_us, cpu_us);
  const auto room = sizeof text - static_cast<std::size_t>(n);
  if (cause <= LateCause::doubt && like > 0)
    std::snprintf(text + n, room,
                  ", while %zu frames around it with as much to do used %.0f us at most", like,
                  like_us);
  else if (cause == LateCause::doubt)
    std::snprintf(text + n, room, ", and no frame around it had as much to do");
  return text;
}

void LateFrame::stepped_again(double us, double period_us) {
  again_us = us;
  if (cause != LateCause::doubt) return;
  if (us > period_us) cause = LateCause::own;
  if (2 * us < period_us) cause = LateCause::machine;
}

void LateJudge::row(const h6FrameRecord& r, const Tell& tell) {
  Row row;
  row.frame = {r.time,
               r.report.frame,
               LateCause::doubt,
               r.late_us,
               r.wakeup_us,
               r.cpu_us,
               r.report.frame_us,
               0,
               0};
  row.late = r.late;
  row.contacts = r.report.contacts;
  row.substeps = r.report.substeps;
  rows_.push_back(row);
  if (rows_.size() > 2 * kNear + 1) rows_.pop_front();
  if (++waiting_ > kNear) judge(rows_.size() - waiting_--, tell);
}

void LateJudge::finish(const Tell& tell) {
  for (; waiting_ > 0; --waiting_) judge(rows_.size() - waiting_, tell);
}

void LateJudge::judge(std::size_t at, const Tell& tell) const {
  const Row& row = rows_[at];
  if (!row.late) return;
  LateFrame frame = row.frame;
  frame.cause = row.late & H6_LATE_COMPUTE  ? LateCause::doubt
                : row.late & H6_LATE_STOLEN ? LateCause::stolen
                                            : LateCause::wakeup;
  if (frame.cause == LateCause::doubt) {
    for (const Row& other : rows_) {
      if (other.late || 10 * other.contacts < 9 * row.contacts || other.substeps < row.substeps)
        continue;
      ++frame.like;
      frame.like_us = std::max(frame.like_us, other.frame.cpu_us);
    }
    if (frame.like >= kEnough && frame.cpu_us <= 2 * frame.like_us) frame.cause = LateCause::own;
    if (frame.like >= kEnough && 4 * frame.like_us < std::min(frame.cpu_us, period_us_))
      frame.cause = LateCause::machine;
  }
  tell(frame);
}

}  // namespace h6::io
