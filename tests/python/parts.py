# SPDX-License-Identifier: Apache-2.0
"""parts.py - what the tests of the Python package share; it ends them where NumPy is missing."""
import os
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("skipped: NumPy is not installed (python3-numpy)")
    sys.exit(77)
os.environ["HAPSIX_CACHE"] = tempfile.mkdtemp()
import hapsix  # noqa: E402

SOURCE = os.environ["HAPSIX_SOURCE"]
SCENE = hapsix.Scene("peg-in-hole")


def cube(half):
    """Vertices and triangles of a cube."""
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.uint32)


def pressed(definition=None, frames=670):
    """A session with its peg pressed to the wall of the hole."""
    session = hapsix.Session(SCENE.model, definition or SCENE.definition())
    for i in range(frames):
        session.step(*SCENE.path(0, 1e-3 * i))
    return session
