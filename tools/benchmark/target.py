"""One scenario's filter cycle on an emulated target, in the stages of `tools/bench host`: instructions, not cycles.

Flown by tools/target, which also tells the classes of instructions, the stack and an estimate of cycles."""
import argparse
import bisect

import flight
import host
import machines
import measure

NOISE = measure.STAGES["noise"]
VARIANTS = {"as_flown": None, **host.VARIANTS}


def add_options(parser):
    systems = [machine.name for machine in machines.ALL if machine.system]
    parser.add_argument("--target", choices=systems, default="cortex-m4f")
    parser.add_argument("--scenario", choices=host.SCENARIOS, default="land-vehicle")
    parser.add_argument("--particles", type=measure.particles, metavar="N", help="default: 1000; the scenario's own")
    parser.add_argument("--steps", type=measure.whole(1, 1000000), metavar="K", help="stop after K cycles (default: the whole run)")
    flight.add_noise(parser)
    measure.add_json(parser)


def of_functions(machine, folder):
    """Instructions of the flight inside of each function by itself, from the plugin's list of blocks."""
    image = flight.player(machine, "O3")
    symbols = sorted((int(address, 16) & ~1, name) for name, address in flight.addresses(machine, image).items()
                     if not name.startswith("$"))
    starts, sums = [address for address, _ in symbols], {}
    for line in (folder / "calls.txt.blocks").read_text().splitlines():
        address, count = line.split()
        name = symbols[bisect.bisect_right(starts, int(address, 16)) - 1][1]
        sums[name] = sums.get(name, 0) + int(count)
    return sums


def stages_of(machine, folder, result):
    """The stages of tools/target, and the noise taken out of the prediction; for a particle and step."""
    noise = sum(count for name, count in of_functions(machine, folder).items() if name in NOISE) / result["steps"]
    flown = result["stages"]
    stages = {"noise": noise, "propagate": flown["predict"] - noise, "weigh": flown["update"], "normalise": flown["normalise"],
              "estimate": flown["estimate"], "resample": flown["resample"]}
    stages["rest"] = sum(flown.values()) - sum(stages.values())
    return {stage: round(count / result["particles"], 2) for stage, count in stages.items()}


def figures(options):
    machine = machines.find(options.target)
    particles = options.particles or (1000 if options.scenario == "land-vehicle" else None)
    totals = {}
    for variant in ("always", "never", "as_flown"):  # the last one's files stay
        wanted = argparse.Namespace(seed=1, particles=particles, filter=None, set=[], steps=options.steps, optimise="O3",
                                    sharpen=None, ess_ratio=VARIANTS[variant], noise=options.noise)
        result = flight.fly(options.scenario, machine, wanted)
        if result["instructions"] is None:
            raise measure.Failure("this QEMU takes no plugin to count with")
        if not result["same_bits"]:
            raise measure.Failure(f"{options.target} does not compute the host's bits", 1)
        totals[variant] = result["instructions"]["per_particle_step"]
    folder = flight.BUILD / "flights" / f"{machine.name}-O3" / options.scenario
    cost = result["instructions"]
    return {
        "schema": 1, "benchmark": "target", "target": options.target, "scenario": options.scenario, "noise": options.noise,
        "compiler": f"{result['compiler']} -O3", "particles": result["particles"], "steps": result["steps"],
        "instructions_not_cycles": True, "instructions_per_particle_step": round(totals["as_flown"], 2),
        "stages": stages_of(machine, folder, result), "resample_never": round(totals["never"], 2),
        "resample_always": round(totals["always"], 2), "cycle_min": cost["min"], "cycle_max": cost["max"],
        "resampling_over_plain": result["resampling"]["ratio"], "arena_bytes": result["arena_bytes"],
        "bytes_per_particle": round(result["arena_bytes"] / result["particles"], 2), "hash": result["hash"],
    }


def show(result):
    total = result["instructions_per_particle_step"]
    print(f"{result['scenario']}{host.noise_of(result)} on {result['target']}, {result['particles']} particles, {result['steps']} cycles, "
          f"{result['compiler']}")
    print("\ninstructions per particle and step (instructions, not cycles):")
    for stage, count in result["stages"].items():
        what = measure.HOLDS[stage] if stage != "rest" else "guidance, forecasts and other answers"
        print(f"  {stage:<10s} {count:8.2f}  {100 * count / total:5.1f} %  {what}")
    ratio = result["resampling_over_plain"]
    print(f"  {'total':<10s} {total:8.2f}" + (f"           a cycle that resamples over one that does not: {ratio:.3f}" if ratio else ""))
    print(f"  {'never':<10s} {result['resample_never']:8.2f}           where it never resamples")
    print(f"  {'always':<10s} {result['resample_always']:8.2f}           where it always does\n")
    print(f"a cycle    {result['cycle_min']} to {result['cycle_max']} instructions")
    print(f"memory     {result['bytes_per_particle']:.2f} bytes per particle (arena of {result['arena_bytes']} bytes)")
    print(f"hash       {result['hash']}: the host's, bit for bit")


def run(options):
    measure.deliver(figures(options), options, show)
    return 0
