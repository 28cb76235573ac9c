# SPDX-License-Identifier: Apache-2.0
"""own_tasks.py - threads and messages of your program: sessions that share a model step on a pool of threads, on
the engine's threads inside of one session, and all in one call on the threads of a Batch. No step holds the
interpreter's lock, and each way gives the same bits. Unlike the C example of this name it brings no allocator and no
parallel_for, which cannot come from Python: the engine calls both without the interpreter's lock."""
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import hapsix

hapsix.set_log(lambda level, sentence: print(f"{level}: {sentence}"))  # on any thread
scene = hapsix.Scene("peg-in-hole")
definition = scene.definition()
definition.max_contacts = 1000
poses = np.array([[scene.path(0, 1e-3 * i)[0]] for i in range(700)])
offsets = np.linspace(0, 1e-3, 8)


def insert(sideways):
    session = hapsix.Session(scene.model, definition)
    return session.follow(poses + [sideways, 0, 0, 0, 0, 0, 0])["report"]["state_hash"][-1]


alone = [insert(x) for x in offsets]
with ThreadPoolExecutor(4) as pool:
    pooled = list(pool.map(insert, offsets))
definition.threads = 2  # helpers that stay with each session
helped = [insert(x) for x in offsets]
definition.threads = 1  # a Batch has threads of its own
batch = hapsix.Batch(scene.model, definition, len(offsets), threads=2)
for pose in poses:
    batch.pose[:, 0] = pose
    batch.pose[:, 0, 0] += offsets
    batch.step()
same = pooled == helped == list(batch.state_hash) == alone
print(f"{len(set(alone))} runs, {'the same' if same else 'other'} bits on every kind of thread")
