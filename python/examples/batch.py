# SPDX-License-Identifier: Apache-2.0
"""batch.py - 64 pegs are pressed to the wall of 64 holes, each a little farther than the one before."""
import numpy as np

import hapsix

scene = hapsix.Scene("peg-in-hole")
definition = scene.definition()
definition.max_contacts = 500
batch = hapsix.Batch(scene.model, definition, 64)
for i in range(40):
    batch.pose[:, 0, 0] += np.linspace(0, 1e-4, 64)  # up to 4 mm sideways
    batch.step(5)
print(f"forces from {batch.command[0, 0, 0]:.2f} to {batch.command[-1, 0, 0]:.2f} N")
