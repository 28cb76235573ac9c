# SPDX-License-Identifier: Apache-2.0
"""weights.py - contacts of any simulator: a thousand in one place are as stiff as one."""
import numpy as np

import hapsix

for n in (1, 10, 1000):
    weights, wrench, stiffness, damping = hapsix.weigh(
        normals=np.tile([0, 0, 1], (n, 1)), arms=np.zeros((n, 3)), depths=np.full(n, 1e-3), voxel=1e-3,
        lever=0.05, contact=hapsix.Contact(method="robust", stiffness=1e3))
    print(f"{n} contacts: {wrench[2]:.3f} N")
