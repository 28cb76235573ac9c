# SPDX-License-Identifier: Apache-2.0
"""mesh_to_touch.py - triangles in memory become a field and a shell, and a cube is pressed on a cube."""
import numpy as np

import hapsix


def cube(half):
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return hapsix.Mesh(corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


model = hapsix.Model([hapsix.bake_field(cube(20e-3), voxels=64)], [hapsix.bake_shell(cube(10e-3), points=600)])
session = hapsix.Session(model, hapsix.Definition(
    bodies=[hapsix.Body(fixed=True, field=0), hapsix.Body(shell=0, pose=(0, 0, 31e-3, 1, 0, 0, 0))],
    hands=[hapsix.Hand(body=1)]))
for _ in range(1000):
    session.step((0, 0, 29.7e-3, 1, 0, 0, 0))  # the hand is 0.3 mm inside
print(f"{len(session.contacts(1))} contacts, the hand feels {session.command[0, 2]:.2f} N")
