# SPDX-License-Identifier: Apache-2.0
"""own_device.py - a device of your own: it is read, the session steps, and it gets the command. This one is
simulated: it goes down 4 mm in 0.1 s and yields 1 mm for every newton that it is pushed. An arm with motors
belongs on the engine's haptic thread, behind a plug-in in C (hapsix/device_plugin.h)."""
import hapsix


class Arm:
    force = most = 0.0

    def __init__(self, pose):
        self.home = list(pose)

    def read(self, time):
        pose = self.home.copy()
        pose[0] += 4e-2 * min(time, 0.1) + 1e-3 * self.force
        return pose

    def write(self, wrench):
        self.force += 0.01 * (wrench[0] - self.force)  # it is slow
        self.most = max(self.most, abs(self.force))


scene = hapsix.Scene("peg-in-hole")
session = hapsix.Session(scene.model, scene.definition())
arm = Arm(scene.path(0, 0.67)[0])  # in the hole
for i in range(500):
    session.step(arm.read(i / session.rate))
    arm.write(session.command[0])
print(f"{i + 1} frames, fault: {session.safety(0)['fault']}, the arm felt up to {arm.most:.2f} N")
