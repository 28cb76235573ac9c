# SPDX-License-Identifier: Apache-2.0
"""batch_gain.py [SESSIONS] - how much two threads gain over one, on a machine where others work, too.

Batches of the peg (about 100 contacts, as in step_many_bench.cpp) step in turn on one thread and on two.
Each call is short, so that some calls are not interrupted: the best hundredth of the calls counts.
"""
import sys
import time

import numpy as np

import hapsix

COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 64
OUT = 6e-3
scene = hapsix.Scene("peg-in-hole")
definition = scene.definition()
definition.max_contacts = 1000
definition.bodies[1].pose = (0, 0, OUT, 1, 0, 0, 0)
batches = [hapsix.Batch(scene.model, definition, COUNT, threads) for threads in (1, 2)]
share = np.arange(COUNT) / COUNT
took = [[], []]
calls = max(200, 200000 // COUNT)
for frame in range(400 + calls):
    for batch, times in zip(batches, took):
        batch.pose[:, 0, 0] = (7e-3 + 1e-3 * share) * min(1.0, frame / 200)
        batch.pose[:, 0, 1] = 2e-5 * np.sin(0.03 * frame + 6 * share)
        start = time.perf_counter_ns()
        batch.step()
        if frame >= 400:
            times.append(time.perf_counter_ns() - start)
assert np.array_equal(batches[0].state_hash, batches[1].state_hash)
one, two = (np.percentile(times, 1) for times in took)
print(f"{COUNT} sessions at {batches[0].contacts.mean():.0f} contacts: {1e9 * COUNT / one:.0f} steps/s on one thread, "
      f"{1e9 * COUNT / two:.0f} on two, {one / two:.2f} times")
