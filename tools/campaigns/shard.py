"""One shard, wherever it is flown. Dask sends these functions to workers who have no other file of ours: they import only
what every Python has, and an error is a result like another."""
import hashlib
import json
import os
import pathlib
import socket
import subprocess
import threading
import time

TRIES = 3  # of a run that a signal from outside ended


def call(command):
    clean = {key: value for key, value in os.environ.items() if key != "PFLIGHT_DATA"}
    for _ in range(TRIES):
        done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, env=clean, check=False)
        if done.returncode >= 0:
            break
    return done


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
    return {"shard": job["shard"], "rows": rows, "worker": worker, "begin_s": begin, "end_s": time.time()}
