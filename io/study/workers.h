// SPDX-License-Identifier: Apache-2.0
// workers.h - processes that do the runs of a study. A process that dies costs time, no run.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "hapsix/result.h"

namespace h6::study {

struct Work {
  std::string program = "/proc/self/exe";  // a file, or a name in PATH
  // Of a worker: it reads numbers of runs, a line each, and answers each with one line: a row,
  // a tab and the seconds that it took; "?RUN SENTENCE" for a run that is lost, "!SENTENCE" when it
  // cannot go on.
  std::vector<std::string> command;
  std::size_t processes = 1;
  std::size_t ahead = 1;  // runs that a process has at a time
  std::vector<std::size_t> runs;
  std::function<Outcome(const std::string& line, double seconds)> done;  // of a lost run: NaN
  // Gives the line of a run that no process could end.
  std::function<std::string(std::size_t run, const std::string& why)> lost;
  std::function<bool()> go_on;  // asked now and then; false: ends soon
};

// Returns when every run has its line, or go_on() is false.
Outcome share_out(const Work& work);

// The worker's side: answers each line of standard input until it ends, and times each answer.
void serve(const std::function<std::string(std::size_t run)>& answer);

}  // namespace h6::study
