"""What the tools that make many runs share: their errors, the runner, files that are whole or not there, the progress bar."""
import argparse
import hashlib
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Failure(Exception):
    def __init__(self, text, status=3):
        super().__init__(text)
        self.status = status


class Parser(argparse.ArgumentParser):
    """Answers a wrong line with one line, and status 2."""

    def error(self, message):
        self.exit(2, f"{self.prog.removeprefix('tools/')}: {message}; {self.prog} --help says more\n")


def runner():
    """The program behind tools/run, built where it is out of date."""
    if subprocess.run([ROOT / "tools/run", "list"], stdout=subprocess.DEVNULL, check=False).returncode != 0:
        raise Failure("the runner does not build")
    return ROOT / "build/run/tools/pflight_run"


def digest(data):
    return hashlib.sha256(data).hexdigest()[:16]


def write_whole(path, text):
    """Whoever reads it sees all of the text, or what was there before."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=".", suffix=".part", delete=False) as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


class Progress:
    """A bar on a terminal; elsewhere its last line alone."""

    def __init__(self, total, unit, width=30):
        self.total, self.unit, self.width = total, unit, width
        self.done, self.kept, self.begin = 0, 0, time.monotonic()

    def step(self, count=1, kept=False):
        self.done += count
        self.kept += count if kept else 0
        if sys.stderr.isatty() or self.done == self.total:
            filled = self.width * self.done // self.total
            before = f" ({self.kept} kept from before)" if self.kept else ""
            print(f"\r[{'#' * filled}{'.' * (self.width - filled)}] {self.done} of {self.total} {self.unit}{before}, "
                  f"{time.monotonic() - self.begin:.0f} s ", end="\n" if self.done == self.total else "", file=sys.stderr,
                  flush=True)
