#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""soak.py [HOURS] [SEED] - runs build/release/hapsix under seeded trouble, one line a minute.

Each run draws: a scene, a bad operator (seed, kinds, how often), whether it is recorded, and one
trouble from outside: none, SIGKILL, SIGINT, SIGSTOP for a while, a load of busy processes, a file
size limit as on a full disk. Watched: exit codes, memory and descriptors of the program at the end
of each run against its own beginning, and that every recording opens and replays to the bit. A run
ends at a latched fault of its hand, so the next run goes on after it. The report says what came how
often; the exit code is 1 when a promise was broken.
"""
import collections, json, os, random, resource, signal, subprocess, sys, tempfile, time

root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
program = os.environ.get("HAPSIX_PROGRAM", os.path.join(root, "build/release/hapsix"))
hours = float(sys.argv[1]) if len(sys.argv) > 1 else 2
seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
draw = random.Random(seed)
count, broken = collections.Counter(), []
longest_gap = 0.0


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


def check_recording(file, trouble, what):
    code, info = json_of("info", file)
    promise(code == 0 and info, f"{what}: its recording does not open")
    if not info or code != 0:
        return
    count["recordings opened"] += 1
    code, replay = json_of("replay", file, "--verify")
    if replay and replay.get("same"):
        count["recordings replayed to the bit"] += 1
    elif replay and "are missing, the recorder was too slow" in replay.get("error", ""):
        count["recordings with rows missing"] += 1
    else:
        promise(False, f"{what}: replay says {(replay or {}).get('error')}")


def one_run(folder, number):
    scene = draw.choice(["box-on-wall", "peg-in-hole", "alpha-shortcut"])
    kinds = ",".join(draw.sample(["shake", "jerk", "freeze", "nan", "jump", "unplug"], 3))
    device = f"bad-operator?seed={draw.randrange(1000)}&kinds={kinds}&every={draw.choice([0.3, 1, 3])}"
    seconds = draw.uniform(2, 12)
    trouble = draw.choice(["none", "none", "kill", "interrupt", "stop", "load", "full disk"])
    file = os.path.join(folder, f"{number}.h5")
    record = draw.random() < 0.7 or trouble in ("kill", "full disk")
    what = f"run {number} ({scene}, {device}, {trouble})"
    arguments = [program, "run", scene, "--duration", f"{seconds:.2f}", "--device", device, "--json"]
    if record:
        arguments += ["--record", file]
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (300000, 300000))
    with open(os.path.join(folder, "out"), "w") as out, open(os.path.join(folder, "err"), "w") as err:
        child = subprocess.Popen(arguments, stdout=out, stderr=err,
                                 preexec_fn=limit if trouble == "full disk" else None)
    busy = [subprocess.Popen(["sh", "-c", "while :; do :; done"]) for _ in range(8 * (trouble == "load"))]
    begun, first, last, done = time.time(), None, None, False
    try:
        while child.poll() is None:
            age = time.time() - begun
            if age > 1 and first is None:
                first = usage(child.pid)
            last = usage(child.pid) or last
            if trouble == "kill" and age > seconds / 2 and not done:
                child.kill(), (done := True)
            if trouble == "interrupt" and age > seconds / 2 and not done:
                child.send_signal(signal.SIGINT), (done := True)
            if trouble == "stop" and age > seconds / 2 and not done:
                child.send_signal(signal.SIGSTOP), time.sleep(draw.uniform(0.05, 1))
                child.send_signal(signal.SIGCONT), (done := True)
            if age > seconds + 120:
                promise(False, f"{what}: it hangs")
                child.kill()
            time.sleep(0.05)
    finally:
        for process in busy:
            process.kill(), process.wait()
    code = child.returncode
    count[f"trouble: {trouble}"] += 1
    promise(code in (0, 1) or (trouble == "kill" and code == -9), f"{what}: it ended with {code}")
    if first and last:
        promise(last[1] <= first[1] + 2, f"{what}: descriptors grew from {first[1]} to {last[1]}")
        promise(last[0] <= first[0] + 65536, f"{what}: memory grew from {first[0]} to {last[0]} kB")
    try:
        with open(os.path.join(folder, "out")) as out:
            summary = json.load(out)
    except ValueError:
        summary = {}
    for event in summary.get("events", []):
        count[f"event: {event['what']}"] += 1
    if record and (os.path.exists(file) or os.path.exists(file + ".part")):
        check_recording(file, trouble, what)
    for name in os.listdir(folder):
        os.remove(os.path.join(folder, name))


def main():
    end, minute, number = time.time() + 3600 * hours, time.time() + 60, 0
    with tempfile.TemporaryDirectory(prefix="hapsix-soak-") as folder:
        while time.time() < end:
            number += 1
            one_run(folder, number)
            if time.time() >= minute:
                minute += 60
                own = usage(os.getpid())
                print(f"{(time.time() - end) / 3600 + hours:6.2f} h  runs {number}  recordings "
                      f"{count['recordings opened']}  replayed {count['recordings replayed to the bit']}"
                      f"  broken {len(broken)}  own memory {own[0]} kB, descriptors {own[1]}", flush=True)
    print(f"\nseed {seed}, {number} runs")
    for name, times in sorted(count.items()):
        print(f"{times:8d}  {name}")
    for sentence in broken:
        print("BROKEN:", sentence)
    sys.exit(1 if broken else 0)


main()
