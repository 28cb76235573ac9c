// SPDX-License-Identifier: Apache-2.0
// account.h - whether what a recording says of its run as a whole follows from its rows.
#pragma once
#include <string>

#include "io/record/recording.h"
#include "io/run/run_scene.h"
#include "io/run/run_watch.h"

namespace h6::cli {

// Makes events and summary again out of the rows, in order, and compares them with the recorded
// ones. What the rows cannot tell is left out: notes of users, overlaps at the start, figures of
// the clock and the machine. The seal covers those.
class Account {
 public:
  // `recording`: head, events and summary; it must outlive this object.
  Account(const io::LoadedScene& loaded, const io::Recording& recording, bool virtual_time);
  void row(const h6FrameRecord& row) { (void)watch_.rows(&row, nullptr, 1); }
  // After the last row: the first thing that differs, "event 3 (clamped)" or "max_force of its
  // summary". Empty: nothing does. It may take a while.
  std::string first_difference(const io::Progress& progress);

 private:
  std::string event_difference() const;
  std::string summary_difference() const;
  const io::LoadedScene& loaded_;
  const io::Recording& recording_;
  bool virtual_time_;
  RunSummary again_;
  RunWatch watch_;
};

}  // namespace h6::cli
