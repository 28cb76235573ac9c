# SPDX-License-Identifier: Apache-2.0
"""6-DoF haptic rendering: a moving part touches an environment, and the hand feels it at 1 kHz.

    import hapsix
    scene = hapsix.Scene("peg-in-hole")
    session = hapsix.Session(scene.model, scene.definition())
    for i in range(1000):
        session.step(*scene.path(0, 1e-3 * i))
    print(session.command, session.contacts(1).depth)

Units are SI. A pose is (x, y, z, qw, qx, qy, qz) of a body's mesh frame, a velocity and a wrench are the
linear part before the angular one. An array that is called a view shares memory with what it came from.
"""
import sys as _sys
import typing as _typing

try:
    import numpy as _np
    from numpy import typing as _npt
except ImportError:
    raise ImportError(f"hapsix needs NumPy, which {_sys.executable} does not have: install it there, or use "
                      "the Python that has it (Debian: /usr/bin/python3 and python3-numpy)") from None
try:
    from ._hapsix import *  # noqa: F401,F403
except ModuleNotFoundError:
    raise ImportError(f"hapsix was built for another version of Python than {_sys.executable}, which is "
                      f"{_sys.version_info.major}.{_sys.version_info.minor}") from None


def columns(frames: "_npt.NDArray[_np.void]", hands: int = 1) -> "_typing.Dict[str, _npt.NDArray[_typing.Any]]":
    """Frames (Recording.frames, Session.follow) as a dict of columns (n,), most of them views:
    pandas.DataFrame(hapsix.columns(recording.frames(), recording.hands)). Names end in x, y, z, w;
    hand_1_… is the second hand's."""
    report = frames["report"]
    out = {"time": frames["time"]}
    for name in ("frame", "status", "contacts", "max_depth", "max_depth_voxels", "frame_us", "state_hash", "substeps"):
        out[name] = report[name]
    for h in range(hands):
        mark = f"_{h}" if h else ""
        _flatten(out, f"hand{mark}", frames["hand"][:, h])
        _flatten(out, f"command{mark}", frames["command"][:, h])
        _flatten(out, f"body{mark}", frames["body"][:, h])
    return out


def _flatten(out, name, rows):
    if rows.dtype.names is None:
        out[name] = rows
        return
    for member in rows.dtype.names:
        _flatten(out, f"{name}_{member}", rows[member])


def quaternion(axis: "_npt.ArrayLike", angle: float) -> "_npt.NDArray[_np.float64]":
    """(4,) of a turn about an axis (3,) by an angle [rad]."""
    axis = _np.asarray(axis, float)
    return _np.concatenate(([_np.cos(angle / 2)], _np.sin(angle / 2) * axis / _np.linalg.norm(axis)))
