"""What the tools that make many runs share: their errors, the runner, files that are whole or not there, the progress bar,
and the way into one of the project's Python environments."""
import argparse
import hashlib
import importlib.util
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

    def __init__(self, **how):
        super().__init__(**{"formatter_class": argparse.RawDescriptionHelpFormatter, **how})

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
    """Whoever reads it sees all of the text, or what was there before, whatever happens meanwhile."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=".", suffix=".part", delete=False) as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def in_environment(group, *modules):
    """Goes on in build/GROUP-venv where this Python lacks one of the modules."""
    lacking = [name for name in modules if importlib.util.find_spec(name) is None]
    if not lacking:
        return
    venv = ROOT / f"build/{group}-venv"
    if (pathlib.Path(sys.prefix).resolve() == venv.resolve() or
            subprocess.run([ROOT / "tools/setup", group], stdout=sys.stderr, check=False).returncode != 0):
        raise Failure(f"{', '.join(lacking)} cannot be had: tools/setup {group}")
    python = str(venv / "bin/python")
    os.execv(python, [python, "-B", str(pathlib.Path(sys.argv[0]).resolve()), *sys.argv[1:]])


class Progress:
    """A bar on a terminal; elsewhere its last line alone. In a `with`, an error begins a line of its own."""

    def __init__(self, total, unit):
        self.total, self.unit, self.done, self.kept, self.begin = total, unit, 0, 0, time.monotonic()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if sys.stderr.isatty() and self.done < self.total:
            print(file=sys.stderr)

    def step(self, count=1, kept=False):
        self.done += count
        self.kept += count if kept else 0
        if sys.stderr.isatty() or self.done == self.total:
            filled = 30 * self.done // self.total
            before = f" ({self.kept} kept from before)" if self.kept else ""
            print(f"\r[{'#' * filled}{'.' * (30 - filled)}] {self.done} of {self.total} {self.unit}{before}, "
                  f"{time.monotonic() - self.begin:.0f} s ", end="\n" if self.done == self.total else "", file=sys.stderr,
                  flush=True)
