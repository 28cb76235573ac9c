# SPDX-License-Identifier: Apache-2.0
"""ode_contacts.py - another simulator's penalty contacts: a plate of 0.1 kg falls onto boxes in the Open Dynamics
Engine. Unlike here, it falls onto triangles in the C example of this name: Debian's python3-pyode is built without
them. Each contact with the full stiffness throws it; weighed, it stays."""
import numpy as np
import ode

import hapsix

N = 14  # tiles a side, 1 cm wide


def simulate(method):
    tiles = []
    for i in range(N * N):
        tiles.append(ode.GeomBox(lengths=(0.01, 0.01, 0.01)))
        tiles[-1].setPosition((0.01 * (i % N - N // 2), 0.01 * (i // N - N // 2), -0.005))
    plate = ode.GeomBox(lengths=(0.1, 0.1, 0.01))
    world = ode.World()
    world.setGravity((0, 0, -9.81))
    body, mass = ode.Body(world), ode.Mass()
    mass.setBoxTotal(0.1, 0.1, 0.1, 0.01)
    body.setMass(mass)
    plate.setBody(body)
    body.setPosition((0.003, 0.002, 0.01))
    contact = hapsix.Contact(method=method)
    most, highest = 0, 0.0
    for _ in range(2000):
        found = [c.getContactGeomParams() for tile in tiles for c in ode.collide(plate, tile)]
        arms = np.array([f[0] for f in found], np.float32).reshape(-1, 3) - body.getPosition()
        _, wrench, _, _ = hapsix.weigh(
            normals=np.array([f[1] for f in found]).reshape(-1, 3), arms=arms, voxel=1e-3, lever=0.1,
            depths=np.array([f[2] for f in found]), contact=contact,
            velocity=body.getLinearVel() + body.getAngularVel())
        body.addForce(wrench[:3])
        body.addTorque(wrench[3:])
        world.step(1e-3)
        most, highest = max(most, len(found)), max(highest, body.getPosition()[2])
    return most, highest


(contacts, thrown), (_, held) = simulate("none"), simulate("firm")
print(f"{contacts} contacts, highest {thrown:.3f} m without weights, {held:.3f} m with")
