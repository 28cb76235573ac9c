# SPDX-License-Identifier: Apache-2.0
"""hello.py - a scene, its hand on its path, and what the hand feels."""
import hapsix

scene = hapsix.Scene("peg-in-hole")
session = hapsix.Session(scene.model, scene.definition())
deepest = force = 0.0
for i in range(int(scene.duration * session.rate)):
    session.step(*scene.path(0, i / session.rate))
    deepest = max(deepest, session.frame["max_depth_voxels"])
    force = max(force, session.command[0, 2])
print(f"{i + 1} frames, at most {deepest:.2f} voxels deep, up to {force:.1f} N")
