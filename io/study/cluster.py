# SPDX-License-Identifier: Apache-2.0
"""cluster.py - does the runs of a study or a map on the workers of a scheduler of Dask's distributed.

The program starts it with: ADDRESS PROGRAM VERSION SIMD, then `study STUDY SCENE...` or the arguments of
`hapsix map`. It reads numbers of runs, a line each, and answers each with one line: its row, "?RUN
SENTENCE" for a run that no worker could end, or "!SENTENCE" when nothing can go on. Workers need the
program in the same version and nothing else of this tree. Files go to them by the hash of their content,
once for each worker.
"""
import hashlib
import json
import os
import queue
import sys
import threading

try:
    import distributed
except ImportError:
    if sys.executable != "/usr/bin/python3" and os.path.exists("/usr/bin/python3"):
        os.execv("/usr/bin/python3", ["/usr/bin/python3", "-c", sys.orig_argv[2]] + sys.argv[1:])
    print("!--scheduler needs Dask's distributed: Debian's python3-distributed, or `pip install distributed`",
          flush=True)
    sys.exit(1)


def with_assets(value, base, assets):
    """The JSON value with every file that it names replaced by the name that it has on workers."""
    if isinstance(value, dict):
        return {k: with_assets(v, base, assets) for k, v in value.items()}
    if isinstance(value, list):
        return [with_assets(v, base, assets) for v in value]
    if not isinstance(value, str) or not os.path.isfile(os.path.join(base, value)):
        return value
    with open(os.path.join(base, value), "rb") as file:
        content = file.read()
    digest = hashlib.sha256(content).hexdigest()
    assets[digest] = content
    return digest + "-" + os.path.basename(value)


def same(content):
    return content


def do_run(run, job, digests, *contents):
    """On a worker: the row of a run, from a process that it keeps for the next one."""
    import hashlib, os, queue, shutil, subprocess, tempfile  # noqa: E401
    from distributed import get_worker
    worker = get_worker()
    pools = worker.__dict__.setdefault("_hapsix_studies", {})
    pool = pools.setdefault(job["key"], queue.SimpleQueue())

    def start():
        program = os.environ.get("HAPSIX_PROGRAM") or (
            job["program"] if os.path.exists(job["program"]) else shutil.which("hapsix"))
        if not program:
            raise LookupError(f"the worker {worker.address} has no program hapsix: install it, or set HAPSIX_PROGRAM")
        environment = dict(os.environ, HAPSIX_SIMD=job["simd"])
        said = subprocess.run([program, "--version"], capture_output=True, text=True, env=environment)
        if said.returncode != 0 or said.stdout.split(",")[0] != job["version"]:
            raise LookupError(f"the worker {worker.address} has another program: "
                              f"{(said.stdout + said.stderr).strip()}; this is {job['version']}, SIMD {job['simd']}")
        folder = os.path.join(tempfile.gettempdir(), "hapsix-study-" + job["key"])
        if not os.path.exists(folder):
            aside = tempfile.mkdtemp(prefix="hapsix-study-")
            files = {name: text.encode() for name, text in job["texts"].items()}
            for digest, content in zip(digests, contents):
                if hashlib.sha256(content).hexdigest() != digest:
                    raise LookupError(f"an asset came to {worker.address} with another content")
                for name in job["names"]:
                    if name.startswith(digest):
                        files[name] = content
            for name, content in files.items():
                with open(os.path.join(aside, name), "wb") as file:
                    file.write(content)
            try:
                os.rename(aside, folder)  # whole, or that of another worker on this machine
            except OSError:
                shutil.rmtree(aside, ignore_errors=True)
        words = [word.replace("@FOLDER@", folder) for word in job["words"]]
        return subprocess.Popen([program, *words, "--worker"], stdin=subprocess.PIPE,
                                stdout=subprocess.PIPE, text=True, env=environment)
    try:
        try:
            process = pool.get_nowait()
        except queue.Empty:
            process = start()
    except LookupError as error:
        return "!" + str(error)
    try:
        process.stdin.write(f"{run}\n")
        process.stdin.flush()
        row = process.stdout.readline()
    except OSError:
        row = ""
    if not row.endswith("\n"):
        process.kill()
        process.wait()
        raise RuntimeError("the process of this run ended")  # Dask tries it again
    pool.put(process)
    return row[:-1]


def describe_study(study, *scenes):
    """What the workers get of a study: its job and the content of its files."""
    assets, texts, names = {}, {}, []
    with open(study) as file:
        plan = json.load(file)
    given = plan.pop("scene")
    for i, scene in enumerate(scenes):
        base = os.path.dirname(os.path.abspath(scene))
        with open(scene) as file:
            text = with_assets(json.load(file), base, assets)
        local = with_assets(plan, base, assets)
        if isinstance(given, list):
            # The table has it: that of the file, as the program does it, and not that of the copy.
            text["name"] = text.get("name") or os.path.splitext(os.path.basename(scene))[0]
            if local != plan:
                print("!files cannot vary in a list of scenes on a scheduler: each scene has its own", flush=True)
                sys.exit(1)
        plan = local
        names += names_in(text, assets)
        texts[f"scene{i}.json"] = json.dumps(text)
    names += names_in(plan, assets)
    plan["scene"] = list(texts) if isinstance(given, list) else "scene0.json"
    texts["study.json"] = json.dumps(plan)
    return {"words": ["study", "@FOLDER@/study.json", "-o", "@FOLDER@"], "texts": texts,
            "names": sorted(set(names))}, assets


def names_in(value, assets):
    if isinstance(value, dict):
        return [n for v in value.values() for n in names_in(v, assets)]
    if isinstance(value, list):
        return [n for v in value for n in names_in(v, assets)]
    return [value] if isinstance(value, str) and value[:64] in assets else []


def main():
    address, program, version, simd, *words = sys.argv[1:]
    try:
        client = distributed.Client(address, timeout="10s", set_as_default=True)
    except (OSError, ValueError, TimeoutError) as error:
        print(f"!no scheduler answers at {address}: {' '.join(str(error).split())[:200]}", flush=True)
        return 1
    job, assets = describe_study(*words[1:]) if words[0] == "study" else (
        {"words": words, "texts": {}, "names": []}, {})
    job.update(program=program, version=version, simd=simd)
    job["key"] = hashlib.sha256(json.dumps(job, sort_keys=True).encode()).hexdigest()[:24]
    # An asset is a task that gives its content, so it outlives any worker.
    held = [client.submit(same, content, key="hapsix-asset-" + digest) for digest, content in assets.items()]
    answers, mine = queue.SimpleQueue(), os.urandom(4).hex()

    def done(run):
        def tell(future):
            try:
                answers.put(future.result(timeout=30))
            except distributed.CancelledError:
                answers.put(f"!the scheduler at {address} is gone")
            except Exception as error:
                answers.put(f"?{run} {' '.join(str(error).split())[:200]}")
        return tell

    futures = []

    def ask():
        for line in sys.stdin:
            run = int(line)
            future = client.submit(do_run, run, job, list(assets), *held, key=f"hapsix-{job['key']}-{mine}-{run}",
                                   pure=False, retries=3)
            future.add_done_callback(done(run))
            futures.append(future)
        answers.put(None)
    threading.Thread(target=ask, daemon=True).start()
    while (answer := answers.get()) is not None:
        try:
            print(answer, flush=True)
        except OSError:
            break
        if answer.startswith("!"):
            break
    client.cancel([f for f in futures if not f.done()])
    os._exit(0)  # not client.close(): a scheduler that is gone would be waited for


sys.exit(main())
