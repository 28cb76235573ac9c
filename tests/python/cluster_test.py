# SPDX-License-Identifier: Apache-2.0
"""hapsix study and map with --scheduler: on workers of which one is killed, tables are those of this machine."""
import glob
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest

try:
    import distributed  # noqa: F401
except ImportError:
    if sys.executable != "/usr/bin/python3" and os.path.exists("/usr/bin/python3"):
        os.execv("/usr/bin/python3", ["/usr/bin/python3"] + sys.argv)
    print("skipped: Dask's distributed is not installed (python3-distributed)")
    sys.exit(77)
PROGRAM = os.environ["HAPSIX_PROGRAM"]
PLAN = {"hapsix_study": 1, "scene": "peg-in-hole",
        "vary": {"contact.method": ["firm", "global"]},
        "draw": {"bodies.peg.pose.p.x": {"low": -0.2, "high": 0.2}}, "repeats": 12, "seed": 3}


class Cluster:
    """A scheduler and workers on this machine, each a process with files of its own."""

    def __init__(self, folder, workers, environment):
        self.folder, self.environment, self.started = folder, environment, []
        self.file = os.path.join(folder, "scheduler.json")
        self.start("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
                   "--scheduler-file", self.file)
        until = time.monotonic() + 300
        while not os.path.exists(self.file) and time.monotonic() < until:
            time.sleep(0.1)
        with open(self.file) as file:
            self.address = json.load(file)["address"]
        self.workers = [self.start("distributed.cli.dask_worker", self.address, "--nthreads", "1", "--no-nanny",
                                   "--no-dashboard", "--local-directory", os.path.join(folder, str(i)))
                        for i in range(workers)]

    def start(self, module, *arguments):
        log = open(os.path.join(self.folder, f"log-{len(self.started)}"), "w")
        process = subprocess.Popen([sys.executable, "-m", module, *arguments], stdout=log, stderr=log,
                                   env=self.environment, start_new_session=True)
        self.started.append(process)
        return process

    def close(self):
        for process in self.started:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except OSError:
                pass
            process.wait()


class Studies(unittest.TestCase):
    def setUp(self):
        held = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.addCleanup(held.cleanup)
        self.folder = held.name
        os.mkdir(self.at("tmp"))
        self.environment = dict(os.environ, HAPSIX_CACHE=self.at("cache"), TMPDIR=self.at("tmp"))

    def at(self, name):
        return os.path.join(self.folder, name)

    def study(self, out, *arguments, wait=True, plan="study.json"):
        process = subprocess.Popen([PROGRAM, "study", self.at(plan), "-o", self.at(out), *arguments],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=self.environment)
        if not wait:
            return process
        said = process.communicate()
        return process.returncode, said[1]

    def table(self, out, name="runs.csv"):
        try:
            with open(os.path.join(self.at(out), name)) as file:
                return file.read()
        except FileNotFoundError:
            return ""

    def write(self, name, value):
        with open(self.at(name), "w") as file:
            json.dump(value, file)

    def test_three_workers_of_which_one_is_killed_give_the_table_of_this_machine(self):
        # A scene of files, so that meshes must reach the workers.
        subprocess.run([PROGRAM, "scene", "export", "peg-in-hole", self.at("scene")], check=True,
                       capture_output=True, env=self.environment)
        self.write("study.json", dict(PLAN, scene="scene/scene.json"))
        self.assertEqual(self.study("here", "--jobs", "2")[0], 0)
        # The workers bake their own: nothing but the scheduler joins them to this program.
        cluster = Cluster(self.folder, 3, dict(self.environment, HAPSIX_CACHE=self.at("far")))
        self.addCleanup(cluster.close)
        process = self.study("there", "--scheduler", cluster.address, wait=False)
        until = time.monotonic() + 300
        while self.table("there", "runs.csv.part").count("\n") < 4 and time.monotonic() < until:
            time.sleep(0.05)
        os.killpg(random.Random(1).choice(cluster.workers).pid, signal.SIGKILL)
        error = process.communicate()[1]
        self.assertEqual(process.returncode, 0, error)
        self.assertEqual(self.table("there"), self.table("here"))
        self.assertEqual(self.table("there").count("\n"), 25)
        self.assertTrue(glob.glob(self.at("tmp/hapsix-study-*/*-block.stl")), "the mesh came by its hash")

    def test_scenes_of_a_list_reach_the_workers_and_none_may_vary_its_files(self):
        for name in ("peg-in-hole", "box-on-wall"):
            subprocess.run([PROGRAM, "scene", "export", name, self.at(name)], check=True, capture_output=True,
                           env=self.environment)
        with open(self.at("peg-in-hole/scene.json")) as file:
            nameless = json.load(file)
        del nameless["name"]  # the table names it after its file
        self.write("peg-in-hole/scene.json", nameless)
        plan = {"hapsix_study": 1, "scene": ["peg-in-hole/scene.json", "box-on-wall/scene.json", "cone-in-gap"],
                "draw": {"contact.stiffness": {"low": 5000, "high": 20000}}, "repeats": 3}
        self.write("study.json", plan)
        self.assertEqual(self.study("here", "--jobs", "2")[0], 0)
        cluster = Cluster(self.folder, 2, dict(self.environment, HAPSIX_CACHE=self.at("far")))
        self.addCleanup(cluster.close)
        code, error = self.study("there", "--scheduler", cluster.address)
        self.assertEqual(code, 0, error)
        self.assertEqual(self.table("there"), self.table("here"))
        self.assertEqual([line.split(",")[2] for line in self.table("there").splitlines()[1::3]],
                         ["scene", "box-on-wall", "cone-in-gap"])
        self.write("files.json", dict(plan, scene=plan["scene"][:2], vary={"bodies.0.field.mesh": ["block.stl"]}))
        code, error = self.study("files", "--scheduler", cluster.address, plan="files.json")
        self.assertEqual(code, 1, error)
        self.assertIn("files cannot vary in a list of scenes", error)

    def test_a_study_that_is_killed_goes_on_there(self):
        self.write("study.json", dict(PLAN, repeats=6))
        self.assertEqual(self.study("here", "--jobs", "2")[0], 0)
        cluster = Cluster(self.folder, 2, self.environment)
        self.addCleanup(cluster.close)
        process = self.study("there", "--scheduler", cluster.address, wait=False)
        until = time.monotonic() + 300
        while self.table("there", "runs.csv.part").count("\n") < 3 and time.monotonic() < until:
            time.sleep(0.05)
        process.kill()
        process.communicate()
        code, error = self.study("there", "--scheduler", cluster.address)
        self.assertEqual(code, 0, error)
        self.assertEqual(self.table("there"), self.table("here"))

    def test_a_map_there_has_the_rows_of_this_machine_though_a_worker_is_killed(self):
        def rows(name, *arguments):
            process = subprocess.Popen(
                [PROGRAM, "map", "--scenes", "cone-in-gap,box-over-wire", "--methods", "global", "--variations", "3",
                 "--csv", self.at(name), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                env=self.environment)
            return process
        here = rows("here.csv")
        said_here = here.communicate()[0]
        cluster = Cluster(self.folder, 2, self.environment)
        self.addCleanup(cluster.close)
        there = rows("there.csv", "--scheduler", cluster.address)
        time.sleep(2)
        os.killpg(cluster.workers[0].pid, signal.SIGKILL)
        said_there, error = there.communicate()
        self.assertEqual((here.returncode, there.returncode), (0, 0), error)
        self.assertEqual(said_there, said_here)
        with open(self.at("here.csv")) as one, open(self.at("there.csv")) as two:
            table = one.read()
            self.assertEqual(two.read(), table)
        self.assertGreater(table.count("\n"), 2 * 3 * 2 * 3)

    def test_a_missing_scheduler_and_a_wrong_program_get_one_sentence(self):
        self.write("study.json", dict(PLAN, repeats=1))
        code, error = self.study("none", "--scheduler", "tcp://127.0.0.1:9")
        self.assertEqual((code, error.strip().count("\n")), (1, 0), error)
        self.assertIn("no scheduler answers", error)
        wrong = dict(self.environment, HAPSIX_PROGRAM="/bin/true")
        cluster = Cluster(self.folder, 1, wrong)
        self.addCleanup(cluster.close)
        code, error = self.study("wrong", "--scheduler", cluster.address)
        self.assertEqual((code, error.strip().count("\n")), (1, 0), error)
        self.assertIn("has another program", error)
        self.assertEqual(self.table("wrong"), "")


if __name__ == "__main__":
    unittest.main()
