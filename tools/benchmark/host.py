"""One scenario's filter cycle on this machine: instructions by stage, nanoseconds, bytes, hash.

land-vehicle is the reference work, flown by a program of its own. The other scenarios are recorded from tools/run and
played back (tools/targets), so that nothing but the calls to the library is counted."""
import argparse
import shutil

import flight
import measure
from measure import Failure

REPETITIONS = 100
REPLAYED = ["uav-trajectory", "standoff", "gps", "uwb-range"]
SCENARIOS = ["land-vehicle", *REPLAYED]
STEPS = 100
CALLS = ["pfl_predict", "pfl_update", "pfl_estimate", "pfl_resample"]
VARIANTS = {"never": 0.0, "always": 1.0}


def add_options(parser):
    parser.add_argument("--scenario", choices=SCENARIOS, default="land-vehicle")
    parser.add_argument("--particles", type=measure.particles, metavar="N", help="default: 1000; the scenario's own")
    flight.add_noise(parser)
    measure.add_build(parser)
    measure.add_json(parser)


# ---- The reference work ---------------------------------------------------------------------------------------------------


def fly(program, work, particles, steps, ess_ratio=0.5, repetitions=0):
    """Instructions by stage (callgrind), and with repetitions the time too."""
    where = [work, particles, steps, ess_ratio]
    said, profile = measure.callgrind([str(program), "count", *map(str, where)], ["bench_cycle"])
    if repetitions:
        timed = measure.pairs_of([program, "time", *where, repetitions])
        if timed["hash"] != said["hash"]:
            raise Failure("two flights of the same inputs differ", 1)
        said |= timed
    return said, profile.by_stage(measure.STAGES)


def land_vehicle(options):
    program = measure.built("flight_cycle", options.build)
    particles = options.particles or 1000
    work = {"own": "land-vehicle", "antithetic": "land-vehicle-antithetic"}[options.noise]
    said, stages = fly(program, work, particles, STEPS, repetitions=REPETITIONS)
    variants = {name: sum(fly(program, work, particles, STEPS, ratio)[1].values()) for name, ratio in VARIANTS.items()}
    return {"particles": particles, "steps": STEPS, "stages": stages, "variants": variants, "ns": float(said["ns"]),
            "repetitions": REPETITIONS, "arena_bytes": int(said["arena_bytes"]), "hash": said["hash"],
            "resampled": int(said["resampled"])}


# ---- Scenarios off a tape -------------------------------------------------------------------------------------------------


def player(build, port):
    """The player of tools/targets; its pool is larger here than on a flight computer."""
    return measure.built("pflight_replay", build, port=port, define="PLAY_POOL_BYTES=268435456u")


def play(options, folder, ess_ratio):
    """Counts one play of the folder's tape; its line, the instructions by stage."""
    wanted = argparse.Namespace(steps=0, ess_ratio=ess_ratio, sharpen=None, noise=options.noise)
    flight.write_tape(folder / "host.in", folder / "tape.in", wanted)
    said, profile = measure.callgrind([str(player(options.build, "null"))], CALLS, folder)
    return said, profile.by_stage(measure.STAGES)


def ticks(folder):
    values = flight.words(folder / "tape.ticks")
    return [values[i:i + 4] for i in range(0, len(values), 4)]


def time_plays(options, folder, repetitions):
    """Nanoseconds of all calls of a cycle, of each call the least of some plays."""
    best, calls = None, [code for code, name in flight.OPERATIONS.items() if name in CALLS]
    for _ in range(repetitions):
        measure.pairs_of([player(options.build, "posix")], cwd=folder)
        now = [tick[1] for tick in ticks(folder) if tick[0] in calls]
        best = now if best is None else [min(pair) for pair in zip(best, now)]
    return sum(best)


def replayed(options):
    folder = measure.OUT / "tapes" / options.scenario
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    wanted = argparse.Namespace(seed=1, particles=options.particles, filter=None, set=[])
    _, recorded = flight.record(options.scenario, wanted, folder)
    particles, repetitions = flight.words(folder / "host.in")[flight.HEAD_WORDS + 1], 20
    said, stages = play(options, folder, None)
    same = options.noise != "own" or (folder / "tape.out").read_bytes() == (folder / "host.out").read_bytes()
    if not same:
        raise Failure(f"{options.scenario}: the player's answers are not those of tools/run", 1)
    resampled = max(tick[3] for tick in ticks(folder))
    nanoseconds = time_plays(options, folder, repetitions)
    variants = {name: sum(play(options, folder, ratio)[1].values()) for name, ratio in VARIANTS.items()}
    steps = int(said["cycles"])
    return {"particles": particles, "steps": steps, "stages": stages, "variants": variants,
            "ns": nanoseconds / (particles * steps), "repetitions": repetitions, "arena_bytes": int(said["arena"]),
            "hash": recorded["hash"] if options.noise == "own" else said["hash"], "resampled": resampled}


# ---- Figures --------------------------------------------------------------------------------------------------------------


def figures(options):
    raw = land_vehicle(options) if options.scenario == "land-vehicle" else replayed(options)
    per = raw["particles"] * raw["steps"]
    return {
        "schema": 2, "benchmark": "host", "scenario": options.scenario, "noise": options.noise, "build": options.build, "compiler": measure.compiler(),
        "particles": raw["particles"], "steps": raw["steps"], "instructions_not_cycles": True,
        "instructions_per_particle_step": round(sum(raw["stages"].values()) / per, 3),
        "stages": {stage: round(count / per, 3) for stage, count in raw["stages"].items()},
        "resample_never": round(raw["variants"]["never"] / per, 3), "resample_always": round(raw["variants"]["always"] / per, 3),
        "ns_per_particle_step": round(raw["ns"], 3), "repetitions": raw["repetitions"], "arena_bytes": raw["arena_bytes"],
        "bytes_per_particle": round(raw["arena_bytes"] / raw["particles"], 3),
        "resampling_share": round(raw["resampled"] / raw["steps"], 3), "hash": raw["hash"],
    }


def noise_of(result):
    return "" if result["noise"] == "own" else f", {result['noise']} noise"


def show(result):
    total = result["instructions_per_particle_step"]
    print(f"{result['scenario']}{noise_of(result)}, {result['particles']} particles, {result['steps']} cycles, -O3 -march={result['build']}, "
          f"{result['compiler']}")
    print("\ninstructions per particle and step (instructions, not cycles):")
    for stage, count in result["stages"].items():
        print(f"  {stage:<10s} {count:8.2f}  {100 * count / total:5.1f} %  {measure.HOLDS[stage]}")
    print(f"  {'total':<10s} {total:8.2f}           resampling in {100 * result['resampling_share']:.0f} % of the steps")
    print(f"  {'never':<10s} {result['resample_never']:8.2f}           where it never resamples")
    print(f"  {'always':<10s} {result['resample_always']:8.2f}           where it always does\n")
    print(f"time       {result['ns_per_particle_step']:.2f} ns per particle and step (per step the least of "
          f"{result['repetitions']} repetitions)")
    print(f"memory     {result['bytes_per_particle']:.2f} bytes per particle (arena of {result['arena_bytes']} bytes)")
    print(f"hash       {result['hash']} of all estimates")


def run(options):
    measure.deliver(figures(options), options, show)
    return 0
