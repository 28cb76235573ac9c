# SPDX-License-Identifier: Apache-2.0
"""many_sessions.py - 64 pegs are pressed to the wall of 64 holes in one call a frame, each a little farther
than the one before."""
import numpy as np

import hapsix

scene = hapsix.Scene("peg-in-hole")
definition = scene.definition()
definition.max_contacts = 500  # most of a session's memory
batch = hapsix.Batch(scene.model, definition, 64)
for _ in range(200):
    batch.pose[:, 0, 0] += np.linspace(0, 2e-5, 64)  # up to 4 mm sideways
    batch.step()
print(f"forces from {batch.command[0, 0, 0]:.2f} to {batch.command[-1, 0, 0]:.2f} N")
