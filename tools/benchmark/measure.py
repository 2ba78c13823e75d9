"""What the commands of tools/bench share: builds, counts under callgrind, options, output."""
import argparse
import functools
import json
import os
import pathlib
import re
import shutil
import subprocess

from flight import Failure, configure_and_build

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
OUT = ROOT / "build/bench"
BUILDS = ["x86-64", "x86-64-v3"]
PARTICLES_MAX = 1048576

# Where each stage begins, as functions that files of lib/ call each other by; all that one calls counts with it, up to
# the next such function. The same borders as on emulated targets (tools/targets/flight.py).
STAGES = {
    "noise": ["pfl_make_noise", "pfl_rng_normals"],
    "propagate": ["pfl_predict"],
    "weigh": ["pfl_update"],
    "normalise": ["pfl_moments"],
    "estimate": ["pfl_estimate"],
    "resample": ["pfl_resample_now"],
}
HOLDS = {
    "noise": "standard normals, wherever they are used",
    "propagate": "pfl_predict without its noise: the model, checks of finiteness, the batches",
    "weigh": "pfl_update without the two below: log-likelihoods, log-weights, their maximum",
    "normalise": "one sweep: weights, their sum, effective sample size, and the mean (with the covariance if asked for)",
    "estimate": "pfl_estimate, which copies out what that sweep left",
    "resample": "running sums, offspring, copies",
    "rest": "the caller's loop",
}


# ---- Options ----------------------------------------------------------------------------------------------------------


def whole(low, high):
    def parse(text):
        if not re.fullmatch(r"[0-9]{1,9}", text) or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(f"a whole number from {low} to {high} is wanted, not '{text}'")
        return int(text)
    return parse


particles = whole(1, PARTICLES_MAX)


def add_json(parser):
    parser.add_argument("--json", metavar="-|FILE", help="the figures as one JSON object, to stdout or a file")


def add_build(parser):
    parser.add_argument("--build", choices=BUILDS, default="x86-64-v3")


def deliver(result, options, show):
    """Text to read, or one JSON object."""
    if options.json == "-":
        print(json.dumps(result))
        return
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(result, indent=1) + "\n")
    show(result)


# ---- Builds -----------------------------------------------------------------------------------------------------------


def need(command, group="test"):
    if shutil.which(command) is None:
        raise Failure(f"{command} is missing: tools/setup {group}")


def can_run(build):
    if build == "x86-64-v3" and " avx2 " not in pathlib.Path("/proc/cpuinfo").read_text():
        raise Failure("this processor has no AVX2, so it cannot run the x86-64-v3 build; try --build x86-64")


@functools.lru_cache(maxsize=None)
def compiler():
    name = os.environ.get("CC", "gcc")
    need(name, "run")
    version = subprocess.run([name, "-dumpfullversion", "-dumpversion"], capture_output=True, text=True, check=False)
    return f"{name} {version.stdout.split()[0] if version.stdout else ''}".strip()


@functools.lru_cache(maxsize=None)
def built(name, build="x86-64-v3", flags="", port="null", define=""):
    """A program of tools/benchmark or tools/targets with the library under it."""
    can_run(build)
    need("cmake", "run")
    kind = "-".join(filter(None, [build, port if port != "null" else "", re.sub(r"[^a-z0-9]+", "", flags), "large" if define else ""]))
    folder = OUT / kind
    configure_and_build(folder, name, [
        "-DCMAKE_BUILD_TYPE=Release", f"-DPFLIGHT_BOARD_PORT={port}", "-DPFLIGHT_BUILD_TOOLS=OFF", "-DPFLIGHT_BUILD_IMAGES=ON",
        "-DCMAKE_C_FLAGS=" + " ".join(filter(None, [f"-march={build}", flags, define and f"-D{define}"]))])
    return folder / "tools" / ("targets" if name == "pflight_replay" else "benchmark") / name


def output_of(command, **more):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, stdin=subprocess.DEVNULL,
                          check=False, **more)
    if done.returncode != 0:
        raise Failure(f"{' '.join(map(str, command))} ended with {done.returncode}: {(done.stderr or done.stdout).strip()[-600:]}")
    return done.stdout


def pairs_of(command, **more):
    """Runs a program that prints "name value" lines, or "name=value" words."""
    said = output_of(command, **more)
    return dict(re.findall(r"(\w+)[= ](\S+)", said))


# ---- Callgrind --------------------------------------------------------------------------------------------------------


class Profile:
    """Of a callgrind file: instructions of each function by itself, and of each call from one to another with all that
    it brought about."""

    def __init__(self, text):
        self.own, self.calls = {}, {}
        names, function, callee = {}, None, None

        def name_of(spec):
            number, _, name = spec.partition(" ")
            if name:
                names[number] = re.sub(r"[.@'].*$", "", name)
            return names[number]

        for line in text.splitlines():
            if line.startswith("fn="):
                function = name_of(line[3:])
            elif line.startswith("cfn="):
                callee = name_of(line[4:])
            elif line.startswith("calls="):
                continue
            elif function and re.match(r"[+*\-0-9]", line):
                count = int(line.split()[1])
                if callee:
                    key = (function, callee)
                    self.calls[key] = self.calls.get(key, 0) + count
                    callee = None
                else:
                    self.own[function] = self.own.get(function, 0) + count

    def total(self):
        return sum(self.own.values())

    def into(self, function):
        """All that calls of a function brought about."""
        return sum(count for (caller, callee), count in self.calls.items() if callee == function and caller != callee)

    def by_stage(self, stages):
        """Instructions by stage. What several stages call is shared out as callgrind counted the calls."""
        stage_of = {function: stage for stage, functions in stages.items() for function in functions}
        callers = {}
        for (caller, callee), count in self.calls.items():
            if caller != callee and count:
                callers.setdefault(callee, []).append((caller, count))
        known = {}

        def shares(function):
            if function not in known:
                known[function] = {"rest": 1.0}  # also ends a recursion
                if function in stage_of:
                    known[function] = {stage_of[function]: 1.0}
                elif function in callers:
                    total, mixed = sum(count for _, count in callers[function]), {}
                    for caller, count in callers[function]:
                        for stage, share in shares(caller).items():
                            mixed[stage] = mixed.get(stage, 0.0) + share * count / total
                    known[function] = mixed
            return known[function]

        sums = dict.fromkeys([*stages, "rest"], 0.0)
        for function, count in self.own.items():
            for stage, share in shares(function).items():
                sums[stage] += share * count
        return sums


def callgrind(command, inside, folder=None):
    """Runs a program under callgrind, which counts inside of the named functions only (all of it where none is named).
    libc is told to copy by its loops: callgrind counts every byte that `rep movsb` moves as an instruction."""
    need("valgrind")
    OUT.mkdir(parents=True, exist_ok=True)
    profile = OUT / f"callgrind.{os.getpid()}"
    tunables = "glibc.cpu.x86_rep_stosb_threshold=1000000000:glibc.cpu.x86_rep_movsb_threshold=1000000000"
    try:
        said = pairs_of(["valgrind", "-q", "--tool=callgrind", f"--callgrind-out-file={profile}",
                         *[f"--toggle-collect={name}" for name in inside], *command],
                        cwd=folder, env={**os.environ, "GLIBC_TUNABLES": tunables})
        return said, Profile(profile.read_text())
    finally:
        profile.unlink(missing_ok=True)
