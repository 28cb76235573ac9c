# SPDX-License-Identifier: Apache-2.0
"""own_device.py - a device of your own, in Python: read, write, stop, and the loop that drives a session from it.
This one is simulated: it goes down 2 mm in 0.1 s and yields 1 mm for every newton that it is pushed. The engine's
haptic thread takes no device from Python: an arm with motors belongs there, as a plug-in in C (device_plugin.h)."""
import numpy as np

import hapsix


class Arm:
    force = most = 0.0

    def read(self, time):
        """The pose of the arm [m]; None: the device is lost."""
        return 4e-3, 4e-3, 5e-3 - 2e-2 * min(time, 0.1) + 1e-3 * self.force, 1, 0, 0, 0

    def write(self, wrench):
        self.force += 0.01 * (wrench[2] - self.force)  # it is slow
        self.most = max(self.most, self.force)

    def stop(self):
        self.force = 0.0


def drive(session, device, frames):
    """Reads, steps and writes; the device is stopped at the end, whatever ends the loop."""
    try:
        for i in range(frames):
            pose = device.read(i / session.rate)
            if pose is None:
                return i
            session.step(pose)
            device.write(session.command[0])
        return frames
    finally:
        device.stop()


distance = np.broadcast_to(1e-3 * (np.arange(8) - 4)[:, None, None], (1, 8, 8, 8))  # a floor at z = 4 mm
floor = hapsix.Field(distance, [[[0]]], np.broadcast_to(distance[0, [0, 7], :1, :1], (2, 2, 2)),
                     origin=(0, 0, 0), voxel_size=1e-3, band=1e-3)
tip = hapsix.Shell([[0, 0, 0]], [[0, 0, 1]])
session = hapsix.Session(hapsix.Model([floor], [tip]), hapsix.Definition(
    bodies=[hapsix.Body(fixed=True, field=0), hapsix.Body(shell=0, pose=(4e-3, 4e-3, 5e-3, 1, 0, 0, 0))],
    hands=[hapsix.Hand(body=1, safety=hapsix.Safety(max_force=3))]))
arm = Arm()
frames = drive(session, arm, 500)
print(f"{frames} frames, fault: {session.safety(0)['fault']}, the arm felt up to {arm.most:.2f} N")
