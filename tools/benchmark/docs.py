"""The tables of docs/performance.md: writes them anew (some ten minutes), or checks those that are quick to measure.

Checked are tables of instructions alone, which repeat with one compiler; tables with times are only ever written."""
import argparse

import documents
import guards
import host
import kernels
import measure
import peers
import scaling
import target

TARGETS = ["cortex-m4f", "cortex-m7", "rv32imafc"]


def add_options(parser):
    group = parser.add_mutually_exclusive_group(required=True)
    group.add_argument("--update", action="store_true", help="measure and write all tables, or those of --only")
    group.add_argument("--check", action="store_true", help="exit 1 when a quick table is stale")
    parser.add_argument("--only", action="append", choices=list(TABLES), default=[], help="this table; may be repeated")


def quiet(module, *arguments):
    """The figures of a command with these options."""
    parser = argparse.ArgumentParser()
    module.add_options(parser)
    return module.figures(parser.parse_args([str(argument) for argument in arguments]))


def row(cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def head(cells):
    return [row(cells), "|" + "---|" * len(cells)]


STAGES = list(measure.STAGES)


def stage_cells(result):
    return [f"{result['stages'][stage]:.1f}" for stage in STAGES]


def cycle():
    results = [(build, quiet(host, "--build", build)) for build in measure.BUILDS]
    results += [(name, quiet(target, "--target", name)) for name in TARGETS]
    results += [("x86-64-v3, antithetic noise", quiet(host, "--noise", "antithetic")),
                ("cortex-m4f, antithetic noise", quiet(target, "--noise", "antithetic"))]
    lines = head(["land-vehicle, N = 1000", "all", *STAGES, "never resampling", "always"])
    for name, result in results:
        lines.append(row([f"{name}, {result['compiler']}", f"{result['instructions_per_particle_step']:.1f}", *stage_cells(result),
                          f"{result['resample_never']:.1f}", f"{result['resample_always']:.1f}"]))
    lines += ["", f"{results[0][1]['bytes_per_particle']:.1f} bytes a particle, all of the arena. `tools/bench host --build BUILD` and "
              "`tools/bench target --target TARGET`; the two fly different recordings of the same scenario."]
    return "\n".join(lines)


def scenarios():
    lines = head(["scenario, x86-64-v3", "N", "all", *STAGES, "ns", "bytes a particle"])
    for name in host.SCENARIOS:
        try:
            result = quiet(host, "--scenario", name)
        except measure.Failure as failure:
            lines.append(row([f"{name}: not measured, {failure}"] + ["-"] * 10))
            continue
        lines.append(row([name, result["particles"], f"{result['instructions_per_particle_step']:.1f}", *stage_cells(result),
                          f"{result['ns_per_particle_step']:.1f}", f"{result['bytes_per_particle']:.1f}"]))
    return "\n".join([*lines, "", "`tools/bench host --scenario SCENARIO`; times of a shared virtual machine."])


def kernels_alone():
    result = quiet(kernels)
    where = list(next(iter(result["kernels"].values()))["instructions"])
    lines = head(["kernel", *where, "an element is"])
    for name, kernel in result["kernels"].items():
        lines.append(row([name, *(f"{kernel['instructions'][column]:.1f}" for column in where), kernel["what"]]))
    agree = "All of them left the same bits on all three." if result["all_agree"] else "NOT the same bits on all three."
    return "\n".join([*lines, "", f"{agree} `tools/bench kernels`, {result['compiler']} -O3."])


TABLES = {"cycle": cycle, "scenarios": scenarios, "kernels": kernels_alone,
          "guards": lambda: guards.table(quiet(guards)), "scaling": lambda: scaling.table(quiet(scaling)), "peers": lambda: peers.table(quiet(peers))}
CHECKED = ["kernels"]


def run(options):
    if options.update:
        for name in options.only or TABLES:
            documents.write(name, TABLES[name]())
            print(f"docs/performance.md: {name} written")
        return 0
    stale = [name for name in (options.only or CHECKED) if documents.is_stale(name, TABLES[name]())]
    for name in stale:
        print(f"bench: docs/performance.md is stale: tools/bench docs --update --only {name}")
    return 1 if stale else 0
