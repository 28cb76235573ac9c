// SPDX-License-Identifier: Apache-2.0
// run_observer.h - the interface of an observer, which watches a live run and may change it.
#pragma once
#include <cstddef>
#include <functional>
#include <string>

#include "hapsix/hapsix.h"
#include "io/run/run_setup.h"

namespace h6::cli {

// The run makes all calls on the program's main thread.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  // Called before the session is created.
  virtual void prepare(RunSetup&) {}
  // Called when the loop runs. `note` adds an event to the summary and the recording.
  using Note = std::function<void(const std::string& what, const std::string& detail)>;
  virtual void begin(RunSetup& setup, h6Loop* loop, Note note) = 0;
  virtual void rows(const h6FrameRecord* rows, std::size_t count) = 0;
  // Called every few milliseconds. Return false to end the run.
  virtual bool turn() = 0;
  // True while the observer holds the frames back; else their absence means that a driver hangs.
  virtual bool paused() const { return false; }
  virtual void end() {}
};

}  // namespace h6::cli
