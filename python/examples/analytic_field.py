# SPDX-License-Identifier: Apache-2.0
"""analytic_field.py - a field from a function: a bowl of radius 20 mm in bricks that NumPy fills, and a ring of
points that slides down into it under its weight."""
import numpy as np

import hapsix

voxel, low, side = 1e-3, -28e-3, 7  # [m], node (0, 0, 0) [m], bricks along each axis


def bowl(z, y, x):
    """Signed distance at nodes: the obstacle is everything outside of the ball."""
    return 20e-3 - np.sqrt(sum((low + voxel * n) ** 2 for n in (x, y, z)))


nodes = bowl(*np.indices((8 * side,) * 3))
samples = nodes.reshape(side, 8, side, 8, side, 8).transpose(0, 2, 4, 1, 3, 5).reshape(-1, 8, 8, 8)
bounds = np.nextafter(bowl(*(8 * np.indices((side + 1,) * 3))).astype(np.float32), np.float32(0))
field = hapsix.Field(samples, np.arange(side**3).reshape((side,) * 3), bounds,  # every brick is kept
                     origin=(low, low, low), voxel_size=voxel, band=8 * voxel)
t = 2 * np.pi * np.arange(32) / 32
outward = np.column_stack([np.cos(t), np.sin(t), np.zeros(32)])
ring = hapsix.Shell(5e-3 * outward, -outward)  # normals point into the part
session = hapsix.Session(hapsix.Model([field], [ring]), hapsix.Definition(
    bodies=[hapsix.Body(fixed=True, field=0), hapsix.Body(shell=0, pose=(8e-3, 0, 0, 1, 0, 0, 0))],
    gravity=(0, 0, -9.81)))
for _ in range(5000):
    session.step()
print(f"the ring is {1e3 * np.linalg.norm(session.body(1)[:3]):.2f} mm from the middle of the bowl")  # sqrt(20^2 - 5^2)
