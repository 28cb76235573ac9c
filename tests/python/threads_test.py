# SPDX-License-Identifier: Apache-2.0
"""Python's threads: others run while a call works, and what they change meanwhile does not reach it."""
import os
import sys
import tempfile
import threading
import unittest

from parts import SCENE, pressed  # first, since it ends the test where NumPy is missing
import hapsix
import numpy as np


class Threads(unittest.TestCase):
    def test_two_threads_do_not_meet_in_one_batch(self):
        batch = hapsix.Batch(SCENE.model, SCENE.definition(), 4, 1)

        def step_long():
            while True:  # the other thread may be first
                try:
                    return batch.step(20000)
                except RuntimeError:
                    pass
        thread = threading.Thread(target=step_long)
        thread.start()
        refused = 0
        while thread.is_alive():  # runs while the other steps: the interpreter's lock is free
            try:
                batch.step()
            except RuntimeError as error:
                refused += 1
                self.assertIn("another thread", str(error))
        thread.join()
        self.assertGreater(refused, 0)

    def assert_others_run(self, prepare, work):
        """Another Python thread has a turn while work(prepare()) runs. Python takes the lock from nobody
        here, so a call that keeps it gives no turn. Destroying takes milliseconds, in which a busy
        machine may not wake the other thread, so there are several tries."""
        turns, done, interval = [0], threading.Event(), sys.getswitchinterval()

        def count():
            while not done.wait(1e-4):
                turns[0] += 1
        thread = threading.Thread(target=count)
        sys.setswitchinterval(1000)
        thread.start()
        try:
            for _ in range(20):
                things = prepare()
                before = turns[0]
                work(things)
                if turns[0] > before:
                    return
        finally:
            sys.setswitchinterval(interval)
            done.set()
            thread.join()
        self.fail("no other thread had a turn")

    def test_other_python_threads_have_no_turn_in_a_call_that_keeps_the_lock(self):
        with self.assertRaisesRegex(AssertionError, "no other thread"):
            self.assert_others_run(lambda: range(30000), sum)

    def test_other_python_threads_run_while_a_session_steps(self):
        session = pressed(frames=300)
        poses = np.tile(session.pose, (30000, 1, 1))
        self.assert_others_run(lambda: poses, session.follow)

    def test_other_python_threads_run_while_contacts_are_named_and_a_stiffness_is_derived(self):
        contacts, model, definition = pressed().contacts(1), SCENE.model, SCENE.definition()
        self.assertGreater(len(contacts), 100)
        # One call takes microseconds, too few for another thread to wake: many calls, none of which waits.
        self.assert_others_run(lambda: range(3000), lambda times: [contacts.names() for _ in times])
        self.assert_others_run(lambda: range(3000), lambda times: [model.stiffness_for(definition) for _ in times])

    def test_other_python_threads_run_while_a_batch_or_recording_is_destroyed(self):
        definition = SCENE.definition()
        definition.max_contacts = 1000
        # The list has the last reference, so the batch is destroyed as the list is emptied.
        self.assert_others_run(lambda: [hapsix.Batch(SCENE.model, definition, 2000, 1)], list.clear)
        with tempfile.TemporaryDirectory() as folder:
            frames = pressed(frames=1).follow(np.array([[SCENE.path(0, 1e-3 * i)[0]] for i in range(5000)]))
            names = iter(os.path.join(folder, f"{i}.h5") for i in range(20))

            def unfinished():
                recorder = hapsix.Recorder(next(names), SCENE)
                recorder.record(frames)
                return [recorder]
            self.assert_others_run(unfinished, list.clear)

    def assert_a_copy_is_read(self, use, hands=()):
        """use(definition) gives the places of the bodies that it saw. Another thread gives the definition
        another body meanwhile; so many bodies take a call long enough for it to wake."""
        many, one = ([hapsix.Body(fixed=True, pose=(x, 0, 0, 1, 0, 0, 0)) for _ in range(count)]
                     for x, count in ((1, 50000), (2, 1)))
        definition, done = hapsix.Definition(hands=hands), threading.Event()

        def change():
            while not done.is_set():
                definition.bodies = one
        thread = threading.Thread(target=change)
        thread.start()
        try:
            for _ in range(15):
                definition.bodies = many
                seen = list(use(definition))
                self.assertIn(seen, ([1] * len(many), [2]))
        finally:
            done.set()
            thread.join()

    def test_a_session_has_the_bodies_that_its_definition_had_when_it_was_made(self):
        self.assert_a_copy_is_read(lambda d: hapsix.Session(SCENE.model, d).states[:, 0])

    def test_a_recording_has_the_bodies_that_its_definition_had_when_it_began(self):
        with tempfile.TemporaryDirectory() as folder:
            def record(definition):
                hapsix.Recorder(os.path.join(folder, "run.h5"), definition=definition)
                return [2]  # nothing shows the bodies: this fails by a crash
            self.assert_a_copy_is_read(record, [hapsix.Hand(body=0)])

    def test_threads_that_write_or_read_one_recording_take_turns(self):
        def on_four(work):
            threads = [threading.Thread(target=work, args=[i]) for i in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        frames = pressed(frames=1).follow(np.array([[SCENE.path(0, 1e-3 * i)[0]] for i in range(50)]))
        with tempfile.TemporaryDirectory() as folder:
            recorder = hapsix.Recorder(os.path.join(folder, "run.h5"), SCENE)
            on_four(lambda _: [recorder.record(frames) for _ in range(40)])
            recorder.finish()
            recording = hapsix.Recording(os.path.join(folder, "run.h5"))
            self.assertEqual(len(recording), 8000)
            # Each call wrote its rows next to each other.
            np.testing.assert_array_equal(recording.frames()["report"]["frame"], np.tile(frames["report"]["frame"], 160))
            wrong = []

            def read(first):
                for i in range(40):
                    rows = recording.frames(first * 100 + i, 500)
                    if (rows["report"]["frame"] != np.tile(frames["report"]["frame"], 160)[first * 100 + i:][:500]).any():
                        wrong.append((first, i))
            on_four(read)
            self.assertEqual(wrong, [])

    def test_a_frame_is_recorded_whole_while_another_thread_steps_the_session(self):
        session = pressed(frames=1)
        poses = np.tile(session.pose, (20000, 1, 1))
        poses[:, 0, 0] += 1e-9 * np.arange(len(poses))  # a sample of its own in each frame
        with tempfile.TemporaryDirectory() as folder:
            recorder = hapsix.Recorder(os.path.join(folder, "run.h5"), SCENE)
            for _ in range(3):
                followed = []
                thread = threading.Thread(target=lambda: followed.append(session.follow(poses)))
                thread.start()
                while thread.is_alive():
                    recorder.record(session)
                thread.join()
                recorder.record(session)
                recorder.record(followed[0])
            recorder.finish()
            rows = hapsix.Recording(os.path.join(folder, "run.h5")).frames()
        frame, x = rows["report"]["frame"], rows["hand"]["pose"]["p"]["x"][:, 0]
        order = np.argsort(frame, kind="stable")
        same = np.diff(frame[order]) == 0
        self.assertGreater(same.sum(), 0)
        # All rows of a frame have its sample.
        self.assertEqual((np.diff(x[order])[same] != 0).sum(), 0)


if __name__ == "__main__":
    unittest.main()
