#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""kills.py [KILLS] [BUSY] [TOGETHER] [SEED] - what a SIGKILL costs a recording on a loaded machine.

BUSY programs (default 50) compute without end, at the priority of this script. Runs that record are
killed, TOGETHER (default 5) at a time, each at a drawn time between 0.5 and 3 s after its first
command. A plug-in (witness.c) keeps the time of the newest command in a file, so the loss is
exact: that time less the time of the last recorded frame. Every recording must open and replay. The
exit code is 1 when a loss is over half a second.

With HAPSIX_KILLS_PLAIN=1 the runs may not raise their threads, as those of an ordinary user.
"""
import json, os, random, struct, subprocess, sys, tempfile, time

import h5py

root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
program = os.environ.get("HAPSIX_PROGRAM", os.path.join(root, "build/release/hapsix"))
plugin = os.path.join(os.path.dirname(program), "plugins/witness.so")
plain = ["setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice"] * (
    os.environ.get("HAPSIX_KILLS_PLAIN") == "1")
PERIOD, MOST = 1e-3, 0.5  # [s]


def json_of(*arguments):
    done = subprocess.run([program, *arguments, "--json"], capture_output=True, text=True)
    return json.loads(done.stdout)


class Victim:
    def __init__(self, folder, number):
        self.file = os.path.join(folder, f"{number}.h5")
        self.told = os.path.join(folder, f"{number}.told")
        self.life = draw.uniform(0.5, 3)
        self.child = subprocess.Popen(
            plain + [program, "run", "peg-in-hole", "--duration", "600", "--record", self.file,
                     "--device", f"plugin:{plugin}?file={self.told}"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.begun = None

    def newest(self):
        """The time of the newest command [s]; 0 before the second."""
        try:
            with open(self.told, "rb") as file:
                return struct.unpack("d", file.read(8))[0]
        except (OSError, struct.error):
            return 0

    def turn(self):
        """False once it is killed."""
        if self.begun is None and self.newest() > 0:
            self.begun = time.time()
        if self.begun is None or time.time() < self.begun + self.life:
            return True
        self.child.kill()
        self.child.wait()
        return False

    def loss(self):
        """Seconds of frames that are not in the recording."""
        if json_of("info", self.file).get("frames", 0) == 0:
            return self.newest() + PERIOD
        with h5py.File(self.file) as h5:
            t, whole = h5["frames/t"][()], h5["frames/inputs_only"][()] == 0
        if (t[-1] - t[0]) / PERIOD > len(t) - 0.5 or not whole.all():
            gaps.append(self.file)
        return self.newest() - t[-1]


def main():
    losses, wrong = [], 0
    with tempfile.TemporaryDirectory(prefix="hapsix-kills-") as folder:
        json_of("run", "peg-in-hole", "--duration", "0.01", "--virtual-time")  # bakes
        load = [subprocess.Popen(["sh", "-c", "while :; do :; done"]) for _ in range(busy)]
        victims = []
        try:
            while len(victims) < kills:
                now = [Victim(folder, len(victims) + i) for i in range(min(together, kills - len(victims)))]
                victims += now
                while now:
                    now = [v for v in now if v.turn()]
                    time.sleep(0.005)
        finally:
            for process in load:
                process.kill(), process.wait()
        for victim in victims:
            losses.append(victim.loss())
            wrong += not json_of("replay", victim.file, "--verify").get("same")
    losses.sort()
    print(f"{kills} kills, {together} at a time, {busy} busy programs"
          f"{', threads not raised' if plain else ''}: lost {sum(losses) / kills:.3f} s on average, "
          f"median {losses[kills // 2]:.3f} s, most {losses[-1]:.3f} s; over {MOST} s: "
          f"{sum(x > MOST for x in losses)}; recordings with gaps: {len(gaps)}; not replayed: {wrong}")
    sys.exit(1 if losses[-1] > MOST or wrong else 0)


if __name__ == "__main__":
    kills, busy, together, seed = (
        int(a) for a in (sys.argv[1:] + ["100", "50", "5", "23"][len(sys.argv) - 1:]))
    draw, gaps = random.Random(seed), []
    main()
