// SPDX-License-Identifier: Apache-2.0
// workers.h - processes that do the runs of a study. A process that dies costs time, no run.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "hapsix/result.h"

namespace h6::study {

struct Work {
  std::vector<std::string> command;  // of a worker: it reads numbers of runs, a line each, and
                                     // answers each with one line
  std::size_t processes = 1;
  std::vector<std::size_t> runs;
  std::function<Outcome(const std::string& line)> done;
  // Gives the line of a run whose process died every time.
  std::function<std::string(std::size_t run)> lost;
  std::function<bool()> go_on;  // asked now and then; false: ends soon
};

// Returns when every run has its line, or go_on() is false.
Outcome share_out(const Work& work);

// The worker's side: answers each line of standard input until it ends.
void serve(const std::function<std::string(std::size_t run)>& answer);

}  // namespace h6::study
