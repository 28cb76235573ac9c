// SPDX-License-Identifier: Apache-2.0
// run_observer.h - interface of what watches a live run and may change it.
#pragma once
#include <cstddef>
#include <functional>
#include <string>

#include "hapsix/hapsix.h"
#include "io/run/run_setup.h"

namespace h6::cli {

// All calls come on the program's main thread.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  // Before the session is made.
  virtual void prepare(RunSetup&) {}
  // The loop runs; `note` puts an event into summary and recording.
  using Note = std::function<void(const std::string& what, const std::string& detail)>;
  virtual void begin(RunSetup& setup, h6Loop* loop, Note note) = 0;
  virtual void rows(const h6FrameRecord* rows, std::size_t count) = 0;
  // Every few milliseconds. False: end the run.
  virtual bool turn() = 0;
  virtual void end() {}
};

}  // namespace h6::cli
