# SPDX-License-Identifier: Apache-2.0
"""own_tasks.py - threads and messages of your program: sessions that share a model step on a pool of threads.
No step holds the interpreter's lock, and each session has the bits that it has alone."""
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import hapsix

hapsix.set_log(lambda level, sentence: print(f"{level}: {sentence}"))
scene = hapsix.Scene("peg-in-hole")
poses = np.array([[scene.path(0, 1e-3 * i)[0]] for i in range(700)])


def insert(sideways):
    session = hapsix.Session(scene.model, scene.definition())
    return session.follow(poses + [sideways, 0, 0, 0, 0, 0, 0])["report"]["state_hash"][-1]


offsets = np.linspace(0, 1e-3, 8)
with ThreadPoolExecutor(4) as pool:
    together = list(pool.map(insert, offsets))
same = together == [insert(x) for x in offsets]
print(f"{len(set(together))} runs, {'the same' if same else 'other'} bits as one by one")
