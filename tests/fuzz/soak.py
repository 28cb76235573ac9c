#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""soak.py [HOURS] [SEED] - runs build/release/hapsix under seeded trouble, one line a minute.

Each run draws a scene, a hand, and one trouble from outside. The hand is a bad operator (seed, kinds,
how often), whose output is armed again after each latch, an arm of its own process behind UDP, in
real time, or a witness (witness.c): a plug-in in real time with faults of its own, which keeps what it
got and when. The trouble is none, SIGKILL, SIGINT, SIGSTOP for a while, a load of busy processes, a
file size limit as on a full disk, or an arm that is stopped or killed. Now and then a run lasts ten
minutes.

What must hold, or the exit code is 1:
- a run ends as its trouble says, and never hangs;
- its memory and descriptors do not grow from its tenth second on, nor do those of this script;
- every recording opens and replays to the bit;
- in every recording, no force goes out 20 ms after a fault began, nor later in that fault. Lost
  devices and spoilt samples are found in what came in, not only in the causes that the engine names.
  A recording has no row for what the watchdog sends between two frames. So a row whose command came
  more than 20 ms late must name the watchdog. It may be zero itself instead where no watchdog could
  run: the process was stopped, or the machine stood still, which programs above all others tell;
- a witness feels no force 20 ms after its fault began (a hang: 20 ms after it could be known), on the
  machine's clock, and none for longer than that without a command.

The report at the end has the faults by kind, with the longest time to zero force: of recordings in the
time of frames, of witnesses in their own. Recordings that break a promise stay in build/soak-findings.
"""
import collections, json, os, random, resource, shutil, signal, subprocess, sys, tempfile, threading, time

import h5py
import numpy as np

root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
program = os.environ.get("HAPSIX_PROGRAM", os.path.join(root, "build/release/hapsix"))
arm_program = os.path.join(os.path.dirname(program), "hapsix_udp_arm")
kept = os.path.join(root, "build/soak-findings")
plugins = os.path.join(os.path.dirname(program), "plugins")

LIMIT = 0.020  # [s] from the start of a fault to zero force
PERIOD = 0.001  # [s] a frame; a fault begins when the next command is due, and a wake-up takes part of one
HANG = 0.050  # [s] after which a witness that repeats its sample is known to hang
FAULTS = ["not finite", "late", "device lost", "stopped", "overspeed", "pose jump", "bad sample",
          "frozen", "watchdog"]
LOST, AGAIN = 4, 1 | 8  # bits of safety_asked: no answer; armed, out of a fault

count, broken = collections.Counter(), []
slowest = collections.defaultdict(float)  # [s] to zero force, by kind of fault
most_growth = {"memory [kB]": 0, "descriptors": 0}
number = 0


def usage(pid):
    """Resident memory [kB] and open descriptors; None once it has ended."""
    try:
        with open(f"/proc/{pid}/status") as status:
            kb = next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))
        return kb, len(os.listdir(f"/proc/{pid}/fd"))
    except (OSError, StopIteration):
        return None


def promise(holds, sentence):
    if not holds:
        broken.append(sentence)
        print("BROKEN:", sentence, flush=True)


def json_of(*arguments):
    done = subprocess.run([program, *arguments, "--json"], capture_output=True, text=True)
    try:
        return done.returncode, json.loads(done.stdout)
    except ValueError:
        return done.returncode, None


# ---- forces in a recording ----------------------------------------------------------------------

def episodes(rows, frame):
    """First and last + 1 of every stretch of true rows without a missing frame."""
    follows = np.concatenate(([False], rows[:-1])) & (np.diff(frame, prepend=frame[:1]) == 1)
    first = np.flatnonzero(rows & ~follows)
    ends = np.append(np.flatnonzero(~rows | ~follows), len(rows))
    return zip(first, ends[np.searchsorted(ends, first, side="right")])


def spoilt(pose, velocity):
    """Samples that are not numbers, or that no hand can send. All hands here are impedance hands: the
    engine does not read their wrench."""
    values = np.concatenate((pose, velocity), axis=1)
    with np.errstate(invalid="ignore"):
        norm = np.sqrt((pose[:, 3:].clip(-1e6, 1e6) ** 2).sum(axis=1))
        return ~((np.abs(values) <= 1e6).all(axis=1) & (norm > 0.5) & (norm < 2))


class Pulses:
    """A program on each core, above all others, that tells of each time that it woke up 10 ms late."""

    SOURCE = ("import time\nlast = time.monotonic()\nwhile True:\n    time.sleep(0.001)\n    now = time.monotonic()\n"
              "    if now - last > 0.011: print(now, flush=True)\n    last = now")

    def __init__(self):
        self.still, self.programs = [], []
        for core in os.sched_getaffinity(0):
            pulse = subprocess.Popen(["taskset", "-c", str(core), "chrt", "-f", "99", sys.executable, "-c", self.SOURCE],
                                     stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            self.programs.append(pulse)
            threading.Thread(target=self.listen, args=(pulse,), daemon=True).start()

    def listen(self, pulse):
        for line in pulse.stdout:
            self.still.append(float(line))

    def stood_still(self, since):
        return any(at > since for at in self.still)

    def end(self):
        for pulse in self.programs:
            pulse.kill(), pulse.wait()


def check_forces(file, what, stood):
    """`stood`: the process was stopped, or the machine stood still, for a while."""
    with h5py.File(file, "r") as h5:
        frames, dt = h5["frames"], 1 / h5["config"].attrs["rate"]
        names = [n.decode() if isinstance(n, bytes) else n for n in h5["config"].attrs["cause_names"]]
        column = {name: frames[name][()] for name in
                  ("wrench", "causes", "safety_asked", "overdue", "hand_pose", "hand_velocity",
                   "frame")}
    count["frames recorded"] += len(column["frame"])
    for h in range(column["wrench"].shape[1]):
        wrench = column["wrench"][:, h]
        promise(np.isfinite(wrench).all(), f"{what}: a force that is no number was sent")
        zero = ~wrench.any(axis=1)
        passed = dt * np.diff(column["frame"], prepend=column["frame"][:1]) + column["overdue"][:, h]
        causes = column["causes"][:, h]
        kinds = {kind: (causes >> names.index(kind)) & 1 != 0 for kind in FAULTS}
        kinds["(in) no answer"] = column["safety_asked"][:, h] & LOST != 0
        kinds["(in) spoilt sample"] = spoilt(column["hand_pose"][:, h], column["hand_velocity"][:, h])
        for kind, rows in kinds.items():
            for first, end in episodes(rows, column["frame"]):
                # What the watchdog sent meanwhile is in no row.
                hidden = column["overdue"][first:end, h] > LIMIT
                before = ~zero[np.arange(first, end) - 1]
                told = kinds["watchdog"][first:end] | (stood & zero[first:end])
                promise(not (hidden & before & ~told).any(),
                        f"{what}: a command came over 20 ms late in frame {first} and no watchdog")
                since = np.cumsum(passed[first:end]) - passed[first]
                forced = ~zero[first:end]
                count[f"fault: {kind}"] += 1
                promise(not (forced & (since >= LIMIT - 1e-9)).any(),
                        f"{what}: frame {first + int(forced.nonzero()[0][-1]) if forced.any() else 0} "
                        f"has force over 20 ms after '{kind}' began in frame {first}")
                if hidden[:1 + int(np.argmin(forced))].any():
                    by = "the watchdog" if kinds["watchdog"][first:end].any() else "the frame after a stall"
                    count[f"fault: {kind}, ended by {by}"] += 1
                elif not forced.all():
                    slowest[f"fault: {kind}"] = max(slowest[f"fault: {kind}"], since[int(np.argmin(forced))])
        count["latches that ended"] += int(((column["safety_asked"][:, h] & AGAIN) == AGAIN).sum())


TOLD = np.dtype([("at", "f8"), ("force", "f8"), ("what", "u4"), ("trouble", "u4")])
WRITE, STOP, ARM, BEGINS, ENDS, STOOD_STILL = range(6)
TROUBLES = ["", "lost", "not a number", "hang", "jump", "stall"]


def rows_told(file):
    with open(file, "rb") as told:
        told.seek(8)
        kept, room = np.frombuffer(told.read(16), "u8")
        return np.frombuffer(told.read(int(min(kept, room)) * TOLD.itemsize), TOLD)


def check_witness(file, what):
    """What the device got, on the machine's clock. A stop may be told by another thread."""
    rows = rows_told(file)
    rows = rows[np.argsort(rows["at"], kind="stable")]
    still = rows[rows["what"] == STOOD_STILL]
    commands = rows[(rows["what"] == WRITE) | (rows["what"] == STOP)]
    if len(commands) < 2:
        return
    at, force = commands["at"], commands["force"]

    def stood(begin, end):
        """How long the machine gave no thread any time, of what lies in between [s]."""
        first, last = still["at"] - still["force"] + PERIOD, still["at"]
        return np.clip(np.minimum(last, end) - np.maximum(first, begin), 0, None).sum()

    # No command: the watchdog's stop comes a period and 20 ms after the last.
    silent = np.diff(at) - PERIOD
    for i in np.flatnonzero((silent > 0.5 * PERIOD) & (force[:-1] > 0)):
        note_witness("late command", silent[i], LIMIT, stood(at[i], at[i + 1]), what, at[i])
    for begin, kind in rows[["at", "trouble"]][rows["what"] == BEGINS]:
        i = int(np.searchsorted(at, begin))
        ends = rows["at"][(rows["what"] == ENDS) & (rows["at"] > begin)]
        end = ends[0] if len(ends) else at[-1]
        if kind == TROUBLES.index("stall") or i >= len(at) or (i > 0 and force[i - 1] == 0):
            continue  # the watchdog's, or there was no force
        zero = i + int(np.argmin(force[i:] > 0))
        if force[zero] > 0 or at[zero] > end + PERIOD:
            count[f"witness: {TROUBLES[kind]}, over before the force was"] += 1
            promise(end - begin <= (HANG if kind == TROUBLES.index("hang") else 0) + LIMIT + 2 * PERIOD
                    + stood(begin, end), f"{what}: force during all of '{TROUBLES[kind]}' at {begin:.4f}")
            continue
        # The last command before zero may have come late, which the watchdog bounds.
        late = max(0, at[zero] - at[zero - 1] - PERIOD) if zero > 0 else 0
        known = HANG if kind == TROUBLES.index("hang") else 0
        note_witness(TROUBLES[kind], at[zero] - begin - known, LIMIT + late,
                     stood(begin, at[zero]), what, begin)


def note_witness(kind, took, limit, still, what, at):
    count[f"witness: {kind}"] += 1
    count[f"witness: {kind}, over 20 ms and a period"] += took > LIMIT + PERIOD
    slowest[f"witness: {kind}"] = max(slowest[f"witness: {kind}"], took)
    if still > 0 and took > limit + PERIOD:
        count["witness: while the machine stood still"] += 1
    promise(took <= limit + PERIOD + still,
            f"{what}: the device had force {1e3 * took:.1f} ms after '{kind}' at {at:.4f}")


def check_recording(file, what, stood):
    code, info = json_of("info", file)
    promise(code == 0 and info, f"{what}: its recording does not open")
    if not info or code != 0:
        return
    count["recordings opened"] += 1
    if info["frames"] > 0:
        check_forces(file, what, stood)
    code, replay = json_of("replay", file, "--verify")
    if replay and replay.get("same"):
        count["recordings replayed to the bit"] += 1
    elif replay and "are missing, the recorder was too slow" in replay.get("error", ""):
        count["recordings with rows missing"] += 1
    else:
        promise(False, f"{what}: replay says {(replay or {}).get('error')}")


# ---- runs ---------------------------------------------------------------------------------------

class Arm:
    """hapsix_udp_arm as a process; port 0 lets the system pick one."""

    def __init__(self, port=0):
        self.process = subprocess.Popen([arm_program, "--port", str(port), "--press", "0.02",
                                         "--period", "0.5"], stdout=subprocess.PIPE, text=True)
        self.port = int(self.process.stdout.readline())

    def end(self):
        self.process.kill(), self.process.wait(), self.process.stdout.close()


class Trouble:
    """What happens to a run from outside."""

    KINDS = ["none", "none", "kill", "interrupt", "stop", "load", "full disk"]
    ARM_KINDS = ["none", "stop", "load", "arm stopped", "arm killed"]
    WITNESS_KINDS = ["none", "none", "kill", "load"]  # a stop would stop the device, too

    def __init__(self, kind, at, arm):
        self.kind, self.at, self.arm, self.done, self.busy = kind, at, arm, False, []
        if kind == "load":  # idle: whatever else this machine computes goes on
            self.busy = [subprocess.Popen(["chrt", "-i", "0", "sh", "-c", "while :; do :; done"])
                         for _ in range(8)]

    def limits(self):
        if self.kind == "full disk":
            resource.setrlimit(resource.RLIMIT_FSIZE, (300000, 300000))

    def turn(self, child, age):
        if self.done or age < self.at:
            return
        self.done = True
        if self.kind == "kill":
            child.kill()
        if self.kind == "interrupt":
            child.send_signal(signal.SIGINT)
        if self.kind in ("stop", "arm stopped"):
            process = child if self.kind == "stop" else self.arm.process
            process.send_signal(signal.SIGSTOP)
            time.sleep(draw.uniform(0.05, 1))
            process.send_signal(signal.SIGCONT)
        if self.kind == "arm killed":
            port = self.arm.port
            self.arm.end()
            self.arm.__init__(port)

    def end(self):
        for process in self.busy:
            process.kill(), process.wait()


def hand(seconds, told):
    """The device of a run, what else it needs, its kinds of trouble, and its arm if there is one."""
    which = draw.random()
    if which < 0.2:
        arm = Arm()
        return f"plugin:{plugins}/udp_arm.so?port={arm.port}", [], Trouble.ARM_KINDS, arm
    if which < 0.5:
        rows = int(3 * 1000 * seconds) + 10000
        return (f"plugin:{plugins}/witness.so?file={told}&rows={rows}&seed={draw.randrange(10000)}"
                f"&every={draw.choice([0.2, 0.5])}", [], Trouble.WITNESS_KINDS, None)
    kinds = ",".join(draw.sample(["shake", "jerk", "freeze", "nan", "jump", "unplug"], 4))
    device = f"bad-operator?seed={draw.randrange(1000)}&kinds={kinds}&every={draw.choice([0.3, 1, 3])}"
    return device, ["--rearm", f"{draw.uniform(0.05, 0.5):.2f}"], Trouble.KINDS, None


def follow(child, trouble, seconds, log, what):
    """Waits for the end of a run, and watches its memory and descriptors. It begins with its log."""
    asked, begun, first, last = time.time(), None, None, None
    while child.poll() is None:
        time.sleep(0.05)
        if begun is None and os.path.exists(log):
            begun = time.time()
        age = 0 if begun is None else time.time() - begun
        if age > min(10, seconds / 2) and first is None:
            first = usage(child.pid)
        last = usage(child.pid) or last
        trouble.turn(child, age)
        if time.time() - asked > seconds + 900:
            promise(False, f"{what}: it hangs")
            child.kill()
            child.wait()
    if first and last:
        grown = [now - before for now, before in zip(last, first)]
        for name, by in zip(most_growth, grown):
            most_growth[name] = max(most_growth[name], by)
        promise(grown[1] <= 2, f"{what}: descriptors grew from {first[1]} to {last[1]}")
        promise(grown[0] <= 16384, f"{what}: memory grew from {first[0]} to {last[0]} kB")


def one_run(folder):
    scene = draw.choice(["box-on-wall", "peg-in-hole", "alpha-shortcut"])
    told = os.path.join(folder, "told")
    seconds = 600 if number % 200 == 100 else draw.uniform(3, 20)
    device, more, troubles, arm = hand(seconds, told)
    if troubles is Trouble.WITNESS_KINDS:
        seconds = min(seconds, 6)  # nothing arms it after its first latch
    kind = draw.choice(troubles)
    file = os.path.join(folder, f"{number}.h5")
    what = f"run {number} ({scene}, {device}, {kind})"
    arguments = [program, "run", scene, "--duration", f"{seconds:.2f}", "--device", device, "--json",
                 "--record", file, *more]
    begun = time.monotonic()
    trouble, broken_before = Trouble(kind, seconds / 2, arm), len(broken)
    try:
        with open(os.path.join(folder, "out"), "w") as out:
            child = subprocess.Popen(arguments, stdout=out, stderr=subprocess.DEVNULL,
                                     preexec_fn=trouble.limits)
        follow(child, trouble, seconds, file + ".part", what)
    finally:
        trouble.end()
        if arm:
            arm.end()
    count[f"trouble: {kind}"] += 1
    count["hand: arm behind UDP" if arm else "hand: bad operator" if more else "hand: witness"] += 1
    code = child.returncode
    promise(code in (0, 1) or (kind == "kill" and code == -9), f"{what}: it ended with {code}")
    try:
        with open(os.path.join(folder, "out")) as out:
            summary = json.load(out)
    except ValueError:
        summary = {}
    for event in summary.get("events", []):
        count[f"event: {event['what']}"] += 1
    if os.path.exists(file) or os.path.exists(file + ".part"):
        check_recording(file, what, kind == "stop" or pulses.stood_still(begun))
    if os.path.exists(told):
        check_witness(told, what)
    if len(broken) > broken_before:
        os.makedirs(kept, exist_ok=True)
        for kept_file in filter(os.path.exists, (file, told)):
            shutil.copy(kept_file, os.path.join(kept, f"{seed}-{number}-{os.path.basename(kept_file)}"))
    for name in os.listdir(folder):
        os.remove(os.path.join(folder, name))


def watch(begun):
    """One line a minute, from a thread of its own."""
    while True:
        time.sleep(60)
        own = usage(os.getpid())
        print(f"{(time.time() - begun) / 3600:6.2f} h  runs {number}  recordings "
              f"{count['recordings opened']}  replayed {count['recordings replayed to the bit']}  "
              f"faults {sum(n for k, n in count.items() if k.startswith('fault: '))}  witnessed "
              f"{sum(n for k, n in count.items() if k.startswith('witness: ') and ',' not in k)}  broken "
              f"{len(broken)}  own memory {own[0]} kB, descriptors {own[1]}", flush=True)


def report():
    print(f"\nseed {seed}, {number} runs")
    for name, times in sorted(count.items()):
        zero = slowest.get(name)
        print(f"{times:8d}  {name}" + ("" if zero is None else f", zero force after {1e3 * zero:.1f} ms"))
    for name, most in most_growth.items():
        print(f"{most:8d}  most growth of a run: {name}")
    for sentence in broken:
        print("BROKEN:", sentence)


def main():
    global number
    begun = time.time()
    threading.Thread(target=watch, args=(begun,), daemon=True).start()
    with tempfile.TemporaryDirectory(prefix="hapsix-soak-") as folder:
        own = None
        try:
            while time.time() < begun + 3600 * hours:
                number += 1
                one_run(folder)
                own = own or (usage(os.getpid()) if number == 20 else None)
        except KeyboardInterrupt:
            print("interrupted: the last run is not judged", flush=True)
        finally:
            pulses.end()
    if own:
        now = usage(os.getpid())
        promise(now[1] <= own[1] + 2 and now[0] <= own[0] + 65536,
                f"this script grew from {own} to {now} (kB, descriptors)")
    report()
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else 2
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    draw = random.Random(seed)
    pulses = Pulses()
    main()
