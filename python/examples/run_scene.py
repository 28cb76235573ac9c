# SPDX-License-Identifier: Apache-2.0
"""run_scene.py - what `hapsix run` does: a scene, generated or from a file, with its hands on their paths."""
import sys

import hapsix

scene = hapsix.Scene(sys.argv[1] if len(sys.argv) > 1 else "peg-in-hole")
session = hapsix.Session(scene.model, scene.definition())
deepest = force = 0.0
frames = int(scene.duration * session.rate)
for i in range(frames):
    poses, velocities = zip(*(scene.path(hand, i / session.rate) for hand in range(session.hands)))
    session.step(poses, velocities)
    deepest = max(deepest, session.frame["max_depth_voxels"])
    force = max(force, session.command[0, 2])
print(f"{frames} frames, at most {deepest:.2f} voxels deep, up to {force:.1f} N")
