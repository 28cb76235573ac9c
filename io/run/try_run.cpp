// SPDX-License-Identifier: Apache-2.0
#include "io/run/try_run.h"

#include <cmath>

#include "io/run/run_setup.h"

namespace h6::cli {

Result<Trial> try_run(const io::LoadedScene& loaded) {
  RunSetup run(loaded);
  if (Outcome opened = run.open(); !opened) return opened.failure();
  Trial out;
  out.seconds = loaded.duration();
  RunTally tally(loaded, run.def.rate, out.seconds);
  const long frames = std::lround(out.seconds * run.def.rate);
  for (long i = 0; i < frames; ++i) {
    h6FrameRecord r{};
    r.time = static_cast<double>(i) / run.def.rate;
    if (Outcome done = run.step(r); !done) return done.failure();
    if (!out.first_contact && r.report.max_depth_voxels > 0) out.first_contact = r.time;
    tally.frame(r);
  }
  out.totals = tally.totals();
  return out;
}

}  // namespace h6::cli
