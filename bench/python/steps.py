#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What Python costs beyond C, on the peg in its hole: PYTHONPATH=build/release/python bench/python/steps.py

A C step is one of h6StepMany with `steps` frames on one session, where no call of Python lies between two
frames. Times are CPU times of this thread, since other work on a machine interrupts long loops; both ways
take turns, and medians of the turns are compared. The bits of both are compared before a time is printed.
"""
import statistics
import sys
import time

import numpy as np

import hapsix

scene = hapsix.Scene("peg-in-hole")
definition = scene.definition()
definition.max_contacts = 1000
FRAMES, TURNS = 4000, 15


def pressed(batch):
    """The pegs of a batch, pressed to the wall."""
    for i in range(670):
        batch.pose[:, 0] = scene.path(0, 1e-3 * i)[0]
        batch.step()
    return batch


def timed(work):
    start = time.thread_time()
    work()
    return time.thread_time() - start


one = pressed(hapsix.Batch(scene.model, definition, 1, 1))
session = hapsix.Session(scene.model, definition)
for i in range(670):
    session.step(scene.path(0, 1e-3 * i)[0], np.zeros((1, 6)))
pose = session.pose[0].copy()


def in_c():
    one.step(FRAMES)


def in_python():
    for _ in range(FRAMES):
        session.step()


def with_arguments():
    for _ in range(FRAMES):
        session.step(pose)


def of_64():
    many.step()


times = {work: [] for work in (in_c, in_python)}
for _ in range(TURNS):
    for work in times:
        times[work].append(timed(work) / FRAMES * 1e6)
if one.state_hash[0] != session.frame["state_hash"]:
    sys.exit("the two ways differ in their bits")
c, python = (statistics.median(times[work]) for work in times)
print(f"C {c:.2f} us a step at {one.contacts[0]} contacts; session.step() {python - c:+.2f} us")
arguments = [timed(with_arguments) / FRAMES * 1e6 - timed(in_c) / FRAMES * 1e6 for _ in range(TURNS)]
print(f"session.step(pose) {statistics.median(arguments):+.2f} us")

# A batch: the call on no session is all that Python adds; a call on 64 is what it is added to.
empty = hapsix.Batch(scene.model, definition, 0, 1)
call = statistics.median(timed(lambda: [empty.step() for _ in range(FRAMES)]) / FRAMES for _ in range(TURNS)) * 1e6
many = pressed(hapsix.Batch(scene.model, definition, 64, 1))
step = statistics.median(timed(of_64) for _ in range(200)) * 1e6
print(f"Batch: {call:.2f} us a call, {100 * call / step:.2f} % of a call on 64 sessions ({step:.0f} us)")
