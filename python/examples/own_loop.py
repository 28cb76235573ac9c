# SPDX-License-Identifier: Apache-2.0
"""own_loop.py - a loop in real time that records what it does. Python is no place for an arm: its pauses
are the safety chain's business, which hears of them by note_interval."""
import os
import tempfile
import time

import hapsix

scene = hapsix.Scene("peg-in-hole")
session = hapsix.Session(scene.model, scene.definition())
file = os.path.join(tempfile.mkdtemp(), "run.h5")
recorder = hapsix.Recorder(file, scene, program="own_loop.py")
begin = last = time.perf_counter()
for i in range(500):
    session.step(*scene.path(0, i / session.rate))
    now = time.perf_counter()
    session.note_interval(now - last)
    last = now
    recorder.record(session)
    time.sleep(max(0.0, begin + (i + 1) / session.rate - now))
recorder.finish()
columns = hapsix.columns(hapsix.Recording(file).frames())  # pandas.DataFrame(columns) is a table
print(f"{len(columns['time'])} frames recorded, up to {max(columns['contacts'])} contacts")
