"""The golden hashes of test/bits on another machine: all that the library computes, every module, against golden.txt.

The program needs 17 MB, as its inputs are a million numbers each: the Cortex-M are boards with external RAM (machines.LARGE),
not those that flights are counted on."""
import difflib
import re
import subprocess

import flight
import machines
import whole
from machines import ROOT

OUT = ROOT / "build/target/bits"
GOLDEN = ROOT / "test/bits/golden.txt"
PROGRAM = ["bits_main.c", "bits_modules.c", "flights.c"]
NAMES = [*machines.LARGE, *(machine.name for machine in machines.ALL if machine.emulator and not machine.system)]


def sources_and_flags():
    """Of the library, from the list that users include."""
    text = (ROOT / "lib/pflight.cmake").read_text()
    sources = re.findall(r"^  ([a-z_]+\.c)$", text, re.M)
    flags = re.findall(r"^ *(-f[a-z-]+(?:=[a-z]+)?)$", text, re.M)
    if len(sources) < 10 or len(flags) < 3:
        raise flight.Failure("lib/pflight.cmake reads differently")
    return [str(ROOT / "lib/src" / name) for name in sources], flags


def built(machine):
    """The program: on the Cortex-M an image with newlib (whole/), on Linux machines a static one."""
    if machine.system:
        return whole.image(machines.LARGE[machine.name], "whole_bits")
    flight.need(machine.prefix + "gcc")
    flight.need(machine.emulator[0])
    OUT.mkdir(parents=True, exist_ok=True)
    image = OUT / machine.name
    sources, flags = sources_and_flags()
    sources += [str(ROOT / "port/null/port_null.c"), *(str(ROOT / "test/bits" / name) for name in PROGRAM)]
    flags += ["-fexcess-precision=fast"] if machine.name == "s390x" else []
    flight.checked([machine.prefix + "gcc", "-std=c99", "-O3", *flags, "-static", "-I", str(ROOT / "lib/include"), *sources, "-o",
                    str(image)], OUT / f"{machine.name}.log")
    return image


def compare(name):
    """True when the machine prints golden.txt; the lines that differ otherwise."""
    machine = machines.find(name)
    image = built(machine)
    command = machines.LARGE.get(name, machine).command(image)
    done = subprocess.run(["timeout", str(flight.RUN_SECONDS), *command], capture_output=True, text=True, stdin=subprocess.DEVNULL,
                          check=False)
    if done.returncode != 0:
        raise flight.Failure(f"{name}: the program ended with {done.returncode}: {(done.stdout + done.stderr).strip()[-200:]}")
    golden = GOLDEN.read_text().splitlines()
    difference = list(difflib.unified_diff(golden, done.stdout.splitlines(), "golden.txt", name, lineterm="", n=0))
    if difference:
        print("\n".join(difference))
    print(f"{name}: {'NOT ' if difference else ''}the {len(golden)} lines of test/bits/golden.txt")
    return not difference
