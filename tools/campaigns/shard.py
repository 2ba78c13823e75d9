"""One shard, wherever it is flown. Dask sends these functions to workers who have no other file of ours: they import only
what every Python has, and an error is a result like another."""
import hashlib
import json
import math
import os
import pathlib
import socket
import struct
import subprocess
import threading
import time
from random import Random

TRIES = 3  # of a run that a signal from outside ended


def call(command):
    clean = {key: value for key, value in os.environ.items() if key != "PFLIGHT_DATA"}
    for _ in range(TRIES):
        done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, env=clean, check=False)
        if done.returncode >= 0:
            break
    return done


def libm():
    """A digest of what this machine's exp, log, sin ... say: C libraries, and one on different processors, differ in some
    last digits, and with them the figures of some scenarios."""
    random = Random(1)
    numbers = [random.uniform(0.1, 9.0) for _ in range(4000)]
    values = [f(x) for f in (math.exp, math.log, math.sin, math.cos, math.atan) for x in numbers]
    return hashlib.sha256(struct.pack(f"{len(values)}d", *values)).hexdigest()[:16]


def fly(job):
    begin, rows, host = time.time(), [], socket.gethostname()
    wrong = {"shard": job["shard"], "status": 3}
    try:
        if hashlib.sha256(pathlib.Path(job["program"]).read_bytes()).hexdigest()[:16] != job["digest"]:
            return {**wrong, "error": f"{job['program']} on {host} is not the campaign's program"}
        for seed in job["seeds"]:
            done = call([job["program"], *job["line"], "--seed", str(seed), "--threads", "1", "--json", "-"])
            if done.returncode not in (0, 1):  # 1: outside an acceptance or a time budget
                said = done.stderr.strip().removeprefix("run: ") or f"the program ended with {done.returncode}"
                return {**wrong, "error": said, "status": 2 if done.returncode == 2 else 3}
            study = json.loads(done.stdout)
            rows.append({"hash": study["hash"], "figures": {name: metric["mean"] for name, metric in study["metrics"].items()}})
    except (OSError, ValueError) as error:
        return {**wrong, "error": f"{error} on {host}"}
    worker = f"{host}:{os.getpid()}:{threading.get_native_id()}"
    return {"shard": job["shard"], "rows": rows, "libm": libm(), "worker": worker, "begin_s": begin, "end_s": time.time()}
