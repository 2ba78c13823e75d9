"""What each guard of the memory costs in a land-vehicle cycle: instructions, with it alone, by default, and with all.

The guards and their switches: docs/health.md. Every row is a build of its own, on this machine and on a Cortex-M4F."""
import argparse

import flight
import host
import machines
import measure

GUARDS = ["CONFIG", "CONTROL", "CANARIES", "VIEW"]
DEFAULT = {"CONFIG", "CONTROL", "CANARIES"}
ROWS = {"none": set(), "configuration": {"CONFIG"}, "control block": {"CONTROL"}, "canaries": {"CANARIES"}, "view": {"VIEW"},
        "as shipped": DEFAULT, "all on": set(GUARDS)}
SIZES = [300, 1000]


def add_options(parser):
    measure.add_build(parser)
    measure.add_json(parser)


def switches(on):
    return [f"-DPFL_GUARD_{guard}={int(guard in on)}" for guard in GUARDS]


def on_host(build, on, particles):
    program = measure.built("flight_cycle", build, " ".join(switches(on)))
    said, stages = host.fly(program, "land-vehicle", particles, host.STEPS)
    return sum(stages.values()) / host.STEPS, said["hash"]


def on_target(machine, on, particles):
    wanted = argparse.Namespace(seed=1, particles=particles, filter=None, set=[], steps=host.STEPS, optimise="O3", sharpen=None, noise="own",
                                ess_ratio=None, defines=switches(on))
    result = flight.fly("land-vehicle", machine, wanted)
    if result["instructions"] is None or not result["same_bits"]:
        raise measure.Failure("the target cannot count, or computes other bits", 1)
    return result["instructions"]["mean"], result["hash"]


def figures(options):
    machine = machines.find("cortex-m4f")
    places = {f"{options.build}, N = {n}": (lambda on, n=n: on_host(options.build, on, n)) for n in SIZES}
    places |= {f"cortex-m4f, N = {n}": (lambda on, n=n: on_target(machine, on, n)) for n in SIZES}
    cycles, hashes = {}, {}
    for row, on in ROWS.items():
        cycles[row] = {}
        for place, count in places.items():
            cycles[row][place], bits = count(on)
            hashes.setdefault(place, set()).add(bits)
    if any(len(bits) != 1 for bits in hashes.values()):
        raise measure.Failure("a guard changes the results", 1)
    none = cycles["none"]
    return {"schema": 1, "benchmark": "guards", "compiler": measure.compiler(), "instructions_not_cycles": True,
            "cycle": {row: {place: round(count) for place, count in counts.items()} for row, counts in cycles.items()},
            "share": {row: {place: round(count / none[place] - 1, 4) for place, count in counts.items()}
                      for row, counts in cycles.items()}}


def table(result):
    places = list(result["cycle"]["none"])
    lines = ["| guards, instructions of a land-vehicle cycle | " + " | ".join(places) + " |", "|---|" + "---|" * len(places)]
    for row, counts in result["cycle"].items():
        shares = result["share"][row]
        cells = [f"{counts[p]}" + (f" (+{100 * shares[p]:.1f} %)" if row != "none" else "") for p in places]
        lines.append(f"| {row} | " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", f"The same bits in every row. `tools/bench guards`, {result['compiler']}; instructions, not cycles."])


def run(options):
    measure.deliver(figures(options), options, lambda result: print(table(result)))
    return 0
