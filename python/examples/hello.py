# SPDX-License-Identifier: Apache-2.0
"""hello.py - a floor at z = 4 mm in one brick of 1 mm cells, a part of one point, and a hand that presses it."""
import numpy as np

import hapsix

distance = np.broadcast_to(1e-3 * (np.arange(8) - 4)[:, None, None], (1, 8, 8, 8))  # axes brick, z, y, x
bounds = np.broadcast_to(distance[0, [0, 7], :1, :1], (2, 2, 2))
floor = hapsix.Field(distance, [[[0]]], bounds, origin=(0, 0, 0), voxel_size=1e-3, band=1e-3)
tip = hapsix.Shell([[0, 0, 0]], [[0, 0, 1]])
session = hapsix.Session(hapsix.Model([floor], [tip]), hapsix.Definition(
    bodies=[hapsix.Body(fixed=True, field=0), hapsix.Body(shell=0, pose=(0, 0, 5e-3, 1, 0, 0, 0))],
    hands=[hapsix.Hand(body=1)]))
for _ in range(1000):  # a second
    session.step((4e-3, 4e-3, 3e-3, 1, 0, 0, 0))  # held 1 mm below the floor
print(f"the hand feels {session.command[0, 2]:.3f} N, the tip stands at {1e3 * session.body(1)[2]:.3f} mm")
