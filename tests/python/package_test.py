# SPDX-License-Identifier: Apache-2.0
"""The Python package: the same bits as the library, views without copies, sentences for mistakes."""
import os
import re
import subprocess
import sys
import tempfile
import typing
import unittest

from parts import SCENE, SOURCE, cube, pressed  # first, since it ends the test where NumPy is missing
import hapsix
import hapsix.env
import numpy as np


class Sessions(unittest.TestCase):
    def test_a_mesh_in_memory_becomes_a_part_that_is_felt(self):
        field = hapsix.bake_field(hapsix.Mesh(*cube(20e-3)), voxels=64)
        shell = hapsix.bake_shell(hapsix.Mesh(*cube(10e-3)), points=600, levels=4)
        self.assertEqual(len(shell), 600)
        model = hapsix.Model([field], [shell])
        definition = hapsix.Definition(
            bodies=[hapsix.Body(fixed=True, field=0), hapsix.Body(shell=0, pose=(0, 0, 31e-3, 1, 0, 0, 0))],
            hands=[hapsix.Hand(body=1)])
        session = hapsix.Session(model, definition)
        for _ in range(500):
            session.step((0, 0, 29e-3, 1, 0, 0, 0))
        # The hand is 1 mm in: about 1e3 N/m of the coupling, bounded by half a voxel of contact.
        coupling = session.coupling(0)
        self.assertAlmostEqual(session.command[0, 2], min(coupling.max_force, 1.0), delta=0.1)
        self.assertGreater(len(session.contacts(1)), 50)
        self.assertAlmostEqual(session.body(1)[2], 30e-3, delta=0.3e-3)

    def test_steps_one_by_one_and_together_give_the_same_bits(self):
        one, together = pressed(frames=1), pressed(frames=1)
        poses = np.array([[SCENE.path(0, 1e-3 * i)[0]] for i in range(1, 500)])
        for pose in poses:
            one.step(pose, velocity=np.zeros((1, 6)))
        together.velocity[:] = 0
        frames = together.follow(poses)
        self.assertEqual(one.frame["state_hash"], frames[-1]["report"]["state_hash"])
        self.assertEqual(len(frames), 499)
        np.testing.assert_array_equal(one.command[0, :3], list(frames[-1]["command"][0]["wrench"]["force"].item()))

    def test_a_view_shows_the_next_step_without_a_copy(self):
        session = pressed()
        command, pose, contacts = session.command, session.pose, session.contacts(1)
        before, normal = command.copy(), contacts.normal
        for array in (command, pose, normal, contacts.depth, contacts.arm, contacts.point):
            self.assertIsNotNone(array.base)
        self.assertTrue(pose.flags.writeable)
        self.assertFalse(command.flags.writeable)
        pose[0, 1] += 1e-4
        session.step()
        self.assertFalse(np.array_equal(before, command))
        self.assertEqual(normal.shape, (len(contacts), 3))
        np.testing.assert_allclose(np.linalg.norm(session.contacts(1).normal, axis=1), 1, atol=1e-5)

    def test_views_of_bodies_and_of_the_frame_show_each_step_and_copies_keep_theirs(self):
        session = pressed()
        report, states, frame, body = session.report, session.states, session.frame, session.body(1)
        for array in (report, states):
            self.assertIsNotNone(array.base)
            self.assertFalse(array.flags.writeable)
        self.assertEqual((states.shape, report.shape), ((session.bodies, 13), ()))
        poses = np.array([[SCENE.path(0, 1e-3 * i)[0]] for i in range(670, 680)])
        for work in (lambda: session.step(*SCENE.path(0, 0.67)), lambda: session.follow(poses),
                     lambda: session.set_body(1, (1e-3, 0, 5e-3, 1, 0, 0, 0))):
            before = states.copy()
            work()
            self.assertFalse(np.array_equal(states[1], before[1]))
            for i in range(session.bodies):
                np.testing.assert_array_equal(states[i], session.body(i))
            self.assertEqual(report, session.frame)
        self.assertTrue(np.shares_memory(states, session.states) and np.shares_memory(report, session.report))
        self.assertEqual(int(report["frame"]), int(frame["frame"]) + 11)
        self.assertFalse(np.array_equal(states[1], body))
        del session
        self.assertGreater(report["frame"], 0)

    def test_a_view_outlives_its_session(self):
        session = pressed(frames=200)
        depth, expected = session.contacts(1).depth, session.contacts(1).depth.copy()
        del session
        np.testing.assert_array_equal(depth, expected)

    def test_fields_and_shells_are_seen_as_arrays(self):
        field = hapsix.bake_field(hapsix.Mesh(*cube(20e-3)), voxels=64)
        rows = field.brick_index[field.brick_index >= 0]
        self.assertEqual(sorted(rows), list(range(len(field.samples))))
        self.assertEqual(field.far_grid.shape, tuple(n + 1 for n in field.brick_index.shape))
        # A node by its indices, and by the model.
        z, y, x = np.argwhere(field.brick_index >= 0)[0]
        node = np.array(field.origin) + field.voxel_size * (8 * np.array([x, y, z]) + 3)
        distance, gradient, exact = hapsix.Model([field], []).sample_field(0, node[None])
        self.assertTrue(exact[0])
        self.assertAlmostEqual(distance[0], field.samples[field.brick_index[z, y, x], 3, 3, 3], delta=1e-5)
        self.assertEqual(gradient.shape, (1, 3))
        shell = hapsix.bake_shell(hapsix.Mesh(*cube(10e-3)), points=100)
        np.testing.assert_allclose(shell.nx**2 + shell.ny**2 + shell.nz**2, 1, atol=1e-5)
        self.assertAlmostEqual(float(np.abs(shell.x).max()), 10e-3, delta=1e-4)

    def test_a_recording_can_be_read_as_columns_and_replayed(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "run.h5")
            session = hapsix.Session(SCENE.model, SCENE.definition())
            recorder = hapsix.Recorder(file, SCENE, program="test")
            session.velocity[:] = 0
            recorder.record(session.follow(np.array([[SCENE.path(0, 1e-3 * i)[0]] for i in range(300)])))
            session.step()
            recorder.record(session)
            recorder.finish('{"note": "made by a test"}')
            recording = hapsix.Recording(file)
            self.assertEqual((len(recording), recording.rate, recording.whole), (301, 1000, True))
            self.assertIn("made by a test", recording.summary)
            columns = hapsix.columns(recording.frames(), recording.hands)
            self.assertEqual({len(c) for c in columns.values()}, {301})
            self.assertEqual(columns["state_hash"][-1], session.frame["state_hash"])
            self.assertEqual(columns["command_wrench_force_x"][-1], session.command[0, 0])
            self.assertEqual(len(recording.frames(290, 100)), 11)

    def test_a_recording_has_the_shapes_of_bodies_that_bend(self):
        scene = hapsix.Scene("clip-and-rod")
        session = hapsix.Session(scene.model, scene.definition())
        self.assertEqual(session.deformation(1).shape, (0,))
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "bend.h5")
            recorder = hapsix.Recorder(file, scene)
            stepped = []
            for i in range(400):
                session.step(scene.path(0, 1e-3 * i)[0])
                recorder.record(session)
                stepped.append(session.deformation(0))
            recorder.record(session.follow(np.array([[scene.path(0, 0.4)[0]]])))
            recorder.finish()
            bends = hapsix.Recording(file).bends()
            self.assertEqual(list(bends), [0])
            np.testing.assert_array_equal(bends[0][:400], np.array(stepped))
            self.assertGreater(float(np.abs(bends[0][:400]).max()), 0)
            self.assertTrue(np.isnan(bends[0][400:]).all())
            np.testing.assert_array_equal(hapsix.Recording(file).bends(100, 20)[0], bends[0][100:120])
            rigid = os.path.join(folder, "rigid.h5")
            recorder = hapsix.Recorder(rigid, SCENE)
            recorder.record(pressed(frames=3))
            recorder.finish()
            self.assertEqual(hapsix.Recording(rigid).bends(), {})

    def test_a_recording_is_a_table_of_pandas(self):
        try:
            import pandas
        except ImportError:
            self.skipTest("pandas is not installed (python3-pandas)")
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "run.h5")
            recorder = hapsix.Recorder(file, SCENE)
            recorder.record(pressed(frames=1).follow(np.array([[SCENE.path(0, 1e-3 * i)[0]] for i in range(670)])))
            recorder.finish()
            rows = hapsix.Recording(file).frames()
            frames = pandas.DataFrame(hapsix.columns(rows))
        self.assertEqual(len(frames), 670)
        touching = frames[frames.contacts > 0]
        self.assertEqual(len(touching), (rows["report"]["contacts"] > 0).sum())
        self.assertGreater(len(touching), 0)
        self.assertEqual(touching.max_depth.max(), rows["report"]["max_depth"].max())
        self.assertEqual(frames.command_wrench_force_x.iloc[-1], rows["command"]["wrench"]["force"]["x"][-1, 0])

    def test_weights_share_the_stiffness_of_equal_contacts(self):
        n = 40
        normals = np.tile([0, 0, 1.0], (n, 1))
        arms = np.random.default_rng(1).uniform(-0.01, 0.01, (n, 3))
        weights, wrench, stiffness, damping = hapsix.weigh(
            normals, arms, np.full(n, 1e-4), voxel=1e-3, lever=0.02,
            contact=hapsix.Contact(method="gauss3", stiffness=1e4))
        np.testing.assert_allclose(weights, 1 / n, rtol=1e-5)
        self.assertAlmostEqual(wrench[2], 1e4 * 1e-4, places=5)
        self.assertAlmostEqual(stiffness[2, 2], -1e4, places=1)
        self.assertEqual(damping.shape, (6, 6))

    def test_a_method_keeps_its_pieces(self):
        for name in ("firm", "gauss6+facing+depth", "robust+cluster"):
            self.assertEqual(hapsix.Contact(method=name).method, name)


class Mistakes(unittest.TestCase):
    def sentence(self, kind, work):
        with self.assertRaises(kind) as raised:
            work()
        self.assertGreater(len(str(raised.exception)), 15)
        return raised.exception

    def test_an_error_of_the_library_has_its_sentence_and_code(self):
        error = self.sentence(hapsix.Error, lambda: hapsix.Scene("no-such-scene"))
        self.assertEqual((error.code, isinstance(error, RuntimeError)), ("file", True))
        definition = SCENE.definition()
        definition.bodies[1].mass = -1
        error = self.sentence(hapsix.Error, lambda: hapsix.Session(SCENE.model, definition))
        self.assertIn("mass", str(error))
        self.assertEqual(error.code, "range")

    def test_wrong_shapes_names_and_indices_are_refused_in_a_sentence(self):
        session = pressed(frames=1)
        self.sentence(ValueError, lambda: session.step((1, 2, 3)))
        self.sentence(ValueError, lambda: session.follow(np.zeros((5, 7))))
        self.sentence(ValueError, lambda: hapsix.Mesh(np.zeros((3, 2)), np.zeros((1, 3))))
        self.sentence(ValueError, lambda: hapsix.Mesh.read("a.stl", unit="furlong"))
        self.sentence(ValueError, lambda: hapsix.Contact(method="firmer"))
        self.sentence(ValueError, lambda: hapsix.weigh(np.zeros((2, 3)), np.zeros((3, 3)), [1, 2], voxel=1, lever=1))
        self.sentence(TypeError, lambda: hapsix.Body(mas=1))
        self.sentence(TypeError, lambda: hapsix.bake_field(hapsix.Mesh(*cube(0.01)), voxel=3))
        for index in (-1, 2, 1 << 20):
            self.sentence(IndexError, lambda: session.body(index))
            self.sentence(IndexError, lambda: session.contacts(index))
        with self.assertRaises(TypeError):
            SCENE.definition().bodies[0].pose[2] = 1  # a tuple: nothing changes in vain

    def test_arrays_that_are_no_field_or_shell_are_refused(self):
        one = dict(samples=np.ones((1, 8, 8, 8)), brick_index=[[[0]]], far_grid=np.ones((2, 2, 2)))
        places = dict(origin=(0, 0, 0), voxel_size=1e-3, band=1e-3)
        field = hapsix.Field(**one, **places)
        self.assertEqual(field.samples.shape, (1, 8, 8, 8))
        self.sentence(ValueError, lambda: field.write(os.path.join(tempfile.mkdtemp(), "a.vdb")))
        for wrong in (dict(samples=np.ones((1, 8, 8))), dict(brick_index=[0]), dict(brick_index=np.zeros((0, 1, 1))),
                      dict(far_grid=np.ones((2, 2, 3)))):
            self.sentence(ValueError, lambda: hapsix.Field(**{**one, **wrong}, **places))
        for wrong in (dict(voxel_size=0.0), dict(voxel_size=float("nan")), dict(origin=(0, 0, float("inf")))):
            of = hapsix.Field(**one, **{**places, **wrong})
            self.sentence(hapsix.Error, lambda: hapsix.Model([of], []))
        for wrong in (dict(brick_index=[[[7]]]), dict(samples=np.full((1, 8, 8, 8), np.nan))):
            of = hapsix.Field(**{**one, **wrong}, **places)
            self.sentence(hapsix.Error, lambda: hapsix.Model([of], []))
        self.sentence(ValueError, lambda: hapsix.Shell(np.zeros((3, 3)), np.zeros((2, 3))))
        for points, normals in ((np.zeros((0, 3)), np.zeros((0, 3))), (np.full((2, 3), np.nan), np.eye(3)[:2])):
            self.sentence(hapsix.Error, lambda: hapsix.Model([], [hapsix.Shell(points, normals)]))

    def test_a_bake_can_be_cancelled_and_passes_an_exception_on(self):
        big = np.random.default_rng(1).normal(size=(60000, 3))
        mesh = hapsix.Mesh(big, np.arange(60000).reshape(-1, 3))
        with self.assertRaises(hapsix.Error) as raised:
            hapsix.bake_field(mesh, voxels=256, progress=lambda what, done: False)
        self.assertEqual(raised.exception.code, "cancelled")

        def fails(what, done):
            raise KeyError("from the callback")
        with self.assertRaises(KeyError):
            hapsix.bake_field(mesh, voxels=256, progress=fails)


class Many(unittest.TestCase):
    def test_each_session_of_a_batch_has_the_bits_that_it_has_alone(self):
        definition = SCENE.definition()
        definition.max_contacts = 500
        alone = [hapsix.Session(SCENE.model, definition) for _ in range(5)]
        for threads in (1, 2):
            batch = hapsix.Batch(SCENE.model, definition, 5, threads)
            alone = [hapsix.Session(SCENE.model, definition) for _ in range(5)]
            for i in range(0, 400, 4):
                for k in range(5):
                    batch.pose[k] = SCENE.path(0, 1e-3 * i + 0.02 * k)[0]
                batch.step(4)
                for k, session in enumerate(alone):
                    for _ in range(4):
                        session.step(batch.pose[k])
                    self.assertEqual(batch.state_hash[k], session.frame["state_hash"])
                    np.testing.assert_array_equal(batch.command[k], session.command)
                    np.testing.assert_array_equal(batch.body[k, 0], session.body(1))
            self.assertGreater(batch.contacts.min(), 20)

    def test_a_session_that_is_reset_repeats_its_bits(self):
        batch = hapsix.Batch(SCENE.model, SCENE.definition(), 3, 2)
        start = batch.pose.copy()

        def push():
            batch.pose[:, 0, 0] += 2e-3
            for _ in range(50):
                batch.step()
            return batch.state_hash.copy()
        first = push()
        batch.reset([1])
        np.testing.assert_array_equal(batch.pose[1], start[1])
        self.assertEqual(batch.contacts[1], 0)
        batch.reset()
        np.testing.assert_array_equal(push(), first)
        with self.assertRaises(IndexError):
            batch.reset([3])


class Imports(unittest.TestCase):
    def imported(self, code):
        """What a Python with another surrounding says of `import hapsix`."""
        return subprocess.run([sys.executable, "-c", code + "\nimport hapsix"], capture_output=True, text=True)

    def test_a_python_without_numpy_hears_what_is_missing(self):
        said = self.imported("import sys; sys.modules['numpy'] = None")
        self.assertIn("hapsix needs NumPy", said.stderr.splitlines()[-1])
        self.assertNotIn("During handling", said.stderr)
        said = self.imported("import sys; sys.modules['hapsix._hapsix'] = None")
        self.assertIn("another version of Python", said.stderr.splitlines()[-1])


class Examples(unittest.TestCase):
    @staticmethod
    def names(folder, ending):
        found = os.listdir(os.path.join(SOURCE, folder))
        return {name[:-len(ending)] for name in found if name.endswith(ending)}

    def test_each_example_in_c_has_a_twin_of_its_name_that_ctest_runs(self):
        in_c = self.names("runtime/examples", ".c") | self.names("io/examples", ".c")
        self.assertGreater(len(in_c), 7)
        twins = self.names("python/examples", ".py")
        self.assertEqual(in_c - twins, set())
        with open(os.path.join(SOURCE, "tests/CMakeLists.txt")) as file:
            run = file.read()
        for name in twins:
            self.assertIn(f"h6_python_test(python.examples.{name} python/examples/{name}.py ", run)

    def test_an_example_has_at_most_60_lines_and_begins_with_what_it_shows(self):
        for name in self.names("python/examples", ".py"):
            with open(os.path.join(SOURCE, f"python/examples/{name}.py")) as file:
                lines = file.read().splitlines()
            self.assertLessEqual(len(lines), 60, name)
            self.assertTrue(lines[1].startswith(f'"""{name}.py - '), name)


class Stubs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(os.path.join(SOURCE, "python/hapsix/_hapsix.pyi")) as file:
            cls.text = file.read()
        cls.names = {"__name__": "stub"}
        exec("from __future__ import annotations\n" + cls.text, cls.names)
        cls.classes = {name: kind for name, kind in cls.names.items() if isinstance(kind, type)
                       and kind.__module__ == "stub" and name in vars(hapsix) and name != "Error"}

    def fits(self, value, kind, where):
        """A value has exactly the type that a stub names."""
        origin, args = typing.get_origin(kind), typing.get_args(kind)
        if origin is np.ndarray:
            self.assertIsInstance(value, np.ndarray, where)
            self.assertIs(value.dtype.type, typing.get_args(args[1])[0], where)
        elif origin is dict:
            self.assertIs(type(value), dict, where)
            for key, of in value.items():
                self.fits(key, args[0], where), self.fits(of, args[1], where)
        elif origin in (tuple, list):
            self.assertIs(type(value), origin, where)
            kinds = args if origin is tuple and args[-1] is not ... else args[:1] * len(value)
            self.assertEqual(len(value), len(kinds), where)
            for of, each in zip(value, kinds):
                self.fits(of, each, where)
        elif hasattr(kind, "__total__"):  # a TypedDict
            hints = typing.get_type_hints(kind, self.names)
            self.assertEqual(set(value), set(hints), where)
            for key, of in value.items():
                self.fits(of, hints[key], f"{where}[{key!r}]")
        else:
            self.assertIs(type(value), getattr(hapsix, kind.__name__, kind), where)

    @staticmethod
    def things():
        """One object of each class, and what each call gives that returns more than one number or object."""
        mesh = hapsix.Mesh(*cube(10e-3))
        field, shell = hapsix.bake_field(mesh, voxels=32), hapsix.bake_shell(mesh, points=50)
        session, scene = pressed(), hapsix.Scene("clip-and-rod")
        bends = hapsix.Session(scene.model, scene.definition())
        bends.step(scene.path(0, 0)[0])
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "run.h5")
            recorder = hapsix.Recorder(file, scene)
            recorder.record(bends)
            recorder.finish()
            recording = hapsix.Recording(file)
            frames, shapes = recording.frames(), recording.bends()
        of = [hapsix.Body(), hapsix.Contact(), hapsix.Coupling(), hapsix.Filter(), hapsix.Hand(), hapsix.Safety(),
              mesh, field, shell, hapsix.Model([field], [shell]), SCENE, hapsix.Definition(pairs=[(1, 0)]), session,
              session.contacts(1), hapsix.Batch(SCENE.model, SCENE.definition(), 2, 1), recording, recorder]
        calls = {
            "Session.body": session.body(1), "Session.deformation": bends.deformation(0),
            "Session.follow": session.follow(session.pose[None]), "Session.safety": session.safety(0),
            "Contacts.names": session.contacts(1).names(), "Scene.path": SCENE.path(0, 0.1),
            "Model.sample_field": SCENE.model.sample_field(0, np.zeros((2, 3))), "Recording.frames": frames,
            "Recording.bends": shapes, "check_field": hapsix.check_field(mesh, field, points=100),
            "weigh": hapsix.weigh([[0, 0, 1]], [[0, 0, 0]], [1e-4], voxel=1e-3, lever=0.1),
            "status_names": hapsix.status_names(1), "cause_names": hapsix.cause_names(2)}
        return {type(thing).__name__: thing for thing in of}, calls

    def test_the_stubs_give_attributes_and_results_the_types_that_they_have(self):
        things, calls = self.things()
        self.assertEqual(set(self.classes), set(things))
        seen = 0
        for name, kind in self.classes.items():
            hints = dict(typing.get_type_hints(kind, self.names))
            for member, about in vars(kind).items():
                if isinstance(about, property):
                    hints[member] = typing.get_type_hints(about.fget, self.names)["return"]
                elif callable(about) and not member.startswith("_"):
                    returned = typing.get_type_hints(about, self.names).get("return")  # none of overloads
                    self.assertEqual(f"{name}.{member}" in calls, self.holds_more(returned), f"{name}.{member}")
            for member, hint in hints.items():
                self.fits(getattr(things[name], member), hint, f"{name}.{member}")
                seen += 1
        self.assertGreater(seen, 130)
        for where, value in calls.items():
            owner, _, member = where.rpartition(".")
            about = getattr(self.names[owner], member) if owner else self.names[member]
            self.fits(value, typing.get_type_hints(about, self.names)["return"], where)

    @staticmethod
    def holds_more(kind):
        """It is an array, or holds other things."""
        return typing.get_origin(kind) is not None or hasattr(kind, "__total__")

    def test_the_check_of_a_type_fails_for_another_type(self):
        self.fits(np.zeros(2, np.float32), self.names["NDArray"][np.float32], "")
        for value, kind in ((np.zeros(2), self.names["NDArray"][np.float32]), ((1.0, 2), typing.Tuple[float, ...]),
                            (True, int), ([1.0], typing.Tuple[float, ...]), ({"state": ""}, self.names["_Safety"])):
            with self.assertRaises(AssertionError):
                self.fits(value, kind, "")

    def test_the_stubs_leave_no_array_or_argument_without_a_type(self):
        body = self.text[self.text.index("class Error"):]
        self.assertNotRegex(body, r"\bAny\b|\*\*kwargs|: object|-> (object|tuple|dict|list)\b")

    def test_the_stubs_name_the_options_that_bakes_take(self):
        with open(os.path.join(SOURCE, "python/bind_assets.cpp")) as file:
            taken = set(re.findall(r'\btake(?:_choice)?\(options, "(\w+)"', file.read()))
        mesh = hapsix.Mesh(*cube(10e-3))
        for bake in ("bake_field", "bake_shell"):
            options = set(typing.get_type_hints(self.names[bake], self.names)) - {"mesh", "progress", "return"}
            self.assertEqual(options & taken, options)
            for option in taken:  # an object is no value of any option
                with self.assertRaises((TypeError, RuntimeError)) as raised:
                    getattr(hapsix, bake)(mesh, **{option: object()})
                self.assertEqual("has no option" in str(raised.exception), option not in options, option)

    def test_the_stubs_say_what_the_module_has(self):
        made = subprocess.run([sys.executable, os.path.join(SOURCE, "python/stubs.py")], capture_output=True,
                              text=True, check=True).stdout
        self.assertEqual(self.text, made, "run python/stubs.py")

    @staticmethod
    def told(doc):
        """A docstring without the signatures that the binding writes by itself."""
        return [line for line in (doc or "").splitlines()
                if line.strip() and line != "Overloaded function." and not re.match(r"(\d+\. )?\w+\(.*\)", line)]

    def test_everything_public_has_a_docstring(self):
        self.assertEqual(self.told("a(x: int) -> int\n\n1. a(self: B) -> C\n"), [])
        seen = 0
        for name, value in vars(hapsix).items():
            if not name.startswith("_") and callable(value):
                self.assertTrue(self.told(value.__doc__), name)
            if not name.startswith("_") and isinstance(value, type):
                for member, about in vars(value).items():
                    if member in ("__init__", "__len__") or not member.startswith("_"):
                        about = about.__func__ if isinstance(about, staticmethod) else about
                        self.assertTrue(self.told(getattr(about, "__doc__", "")), f"{name}.{member}")
                        seen += member.startswith("__")
        self.assertGreater(seen, 18)
        for made in (hapsix.env.AssemblyEnv, hapsix.env.AssemblyVectorEnv):
            self.assertTrue(made.__init__.__doc__, made)


if __name__ == "__main__":
    unittest.main()
