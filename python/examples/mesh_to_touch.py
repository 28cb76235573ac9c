# SPDX-License-Identifier: Apache-2.0
"""mesh_to_touch.py - from two meshes to a force: a block becomes a field and a plate a shell, the plate is pushed
onto the block, and the run is recorded and read again."""
import os
import tempfile

import numpy as np

import hapsix


def box(a, b, c):
    corners = np.array([[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-c, c)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return hapsix.Mesh(corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


block = hapsix.bake_field(box(0.02, 0.02, 0.01), voxels=64)
plate = hapsix.bake_shell(box(0.01, 0.01, 0.002), points=1000)
definition = hapsix.Definition(
    bodies=[hapsix.Body(fixed=True, field=0), hapsix.Body(shell=0, pose=(0, 0, 0.0125, 1, 0, 0, 0))],
    hands=[hapsix.Hand(body=1)])
session = hapsix.Session(hapsix.Model([block], [plate]), definition)
with tempfile.TemporaryDirectory() as folder:
    file = os.path.join(folder, "mesh_to_touch.h5")
    recorder = hapsix.Recorder(file, definition=definition)
    for _ in range(500):
        session.step((0, 0, 0.0115, 1, 0, 0, 0))  # 0.5 mm into the block
        recorder.record(session)
    recorder.finish()
    last = hapsix.Recording(file).frames()[-1]
felt = last["command"][0]["wrench"]["force"]["z"]
print(f"{last['report']['contacts']} contacts, the hand feels {felt:.2f} N")
