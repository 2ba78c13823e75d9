"""Instructions of the filter's calls, cycle by cycle, of the flights of a campaign: under callgrind (G5 of tools/survival)."""
import os
import pathlib
import re
import subprocess
import tempfile

COUNTED = ["call_predict", "call_update", "call_estimate"]  # of calls.c: what makes a cycle
WORLDS = ("land", "gps")  # a process begins with flights without a fault, as many of each


def counts_in(path):
    return [int(count) for count in re.findall(r"^totals: (\d+)$", path.read_text(), re.MULTILINE)]


def fly(program, first, count):
    """Runs in the order of their seeds, until one does not end as it should: (line of the program, dearest cycle to the
    dearest cycle of its kind without a fault)."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/%p", "--combine-dumps=yes",
                               "--collect-atstart=no", *(f"--toggle-collect={name}" for name in COUNTED),
                               "--dump-after=plane_cycle", program, "runs", str(first), str(count)],
                              capture_output=True, text=True, check=False, env={**os.environ, "LC_ALL": "C"})
        files = sorted(pathlib.Path(folder).iterdir(), key=lambda path: path.stat().st_mtime_ns)
        if not files:
            raise OSError(f"valgrind: {done.stderr.strip()[-300:]}")
        parent = max(files, key=lambda path: path.stat().st_size)
        clean = counts_in(parent)
        half = len(clean) // 2
        dearest = {"land": max(clean[:half]), "gps": max(clean[half:])}
        runs = []
        for line, path in zip(done.stdout.splitlines(), (path for path in files if path != parent)):
            runs.append((line, max(counts_in(path)) / dearest[line.split("|")[3]]))
        return runs
