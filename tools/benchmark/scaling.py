"""What a particle costs as their number grows from 100 to 1 000 000, and a state as theirs grows from 2 to 16.

By N: the reference work (land vehicle, 4 states), 20 cycles. By states: a linear chain of masses, 1000 particles, 100
cycles, half of the states seen. Flat means: from N = 300 to 100 000 at most 1.2 times the least."""
import host
import measure

NUMBERS = [100, 300, 1000, 3000, 10000, 30000, 100000, 300000, 1000000]
FLAT = (300, 100000)
FLAT_TIMES, BYTES = 1.2, 30
STATES = range(2, 17, 2)


def add_options(parser):
    parser.add_argument("--max-particles", type=measure.particles, default=NUMBERS[-1], metavar="N", help="leave larger ones out")
    measure.add_build(parser)
    measure.add_json(parser)


def point(program, work, particles, steps):
    repetitions = max(3, min(100, 3000000 // (particles * steps)))
    said, stages = host.fly(program, work, particles, steps, repetitions=repetitions)
    per = particles * steps
    return {"instructions": round(sum(stages.values()) / per, 2), "ns": round(float(said["ns"]), 2),
            "bytes_per_particle": round(int(said["arena_bytes"]) / particles, 2), "resampled": int(said["resampled"]) / steps,
            "stages": {stage: round(count / per, 2) for stage, count in stages.items()}, "hash": said["hash"]}


def figures(options):
    program = measure.built("flight_cycle", options.build)
    by_number = {n: point(program, "land-vehicle", n, 20) for n in NUMBERS if n <= options.max_particles}
    by_states = {d: point(program, f"chain-{d}", 1000, 100) for d in STATES}
    within = [row["instructions"] for n, row in by_number.items() if FLAT[0] <= n <= FLAT[1]]
    return {"schema": 1, "benchmark": "scaling", "build": options.build, "compiler": measure.compiler(),
            "instructions_not_cycles": True, "particles": {str(n): row for n, row in by_number.items()},
            "states": {str(d): row for d, row in by_states.items()},
            "flat": round(max(within) / min(within), 3) if within else None, "flat_wanted": FLAT_TIMES}


def rows(kind, title):
    lines = [f"| {title} | instructions | ns | bytes a particle | resampling | " + " | ".join(measure.STAGES) + " |",
             "|" + "---|" * (5 + len(measure.STAGES))]
    for key, row in kind.items():
        stages = " | ".join(f"{row['stages'][stage]:.1f}" for stage in measure.STAGES)
        lines.append(f"| {key} | {row['instructions']:.1f} | {row['ns']:.1f} | {row['bytes_per_particle']:.1f} | "
                     f"{100 * row['resampled']:.0f} % | {stages} |")
    return lines


def verdict(result):
    if result["flat"] is None:
        return "No number of particles from 300 to 100 000."
    return (f"From N = {FLAT[0]} to {FLAT[1]} the dearest particle takes {result['flat']:.2f} times the instructions of the "
            f"cheapest (wanted: at most {FLAT_TIMES}).")


def table(result):
    return "\n".join([*rows(result["particles"], "N, 4 states"), "", *rows(result["states"], "states, N = 1000"), "",
                      f"{verdict(result)} `tools/bench scaling`, {result['compiler']} -O3 -march={result['build']}; times of a shared "
                      "virtual machine."])


def show(result):
    print(f"per particle and step; instructions, not cycles; {result['compiler']} -O3 -march={result['build']}\n")
    for kind, title in (("particles", "N"), ("states", "states")):
        print(f"{title:>8s}{'instructions':>14s}{'ns':>8s}{'B/particle':>12s}{'resampling':>12s}  " +
              "".join(f"{stage:>11s}" for stage in measure.STAGES))
        for key, row in result[kind].items():
            print(f"{key:>8s}{row['instructions']:14.2f}{row['ns']:8.2f}{row['bytes_per_particle']:12.1f}"
                  f"{100 * row['resampled']:10.0f} %  " + "".join(f"{row['stages'][stage]:11.2f}" for stage in measure.STAGES))
        print()
    print(verdict(result))


def run(options):
    result = figures(options)
    measure.deliver(result, options, show)
    return 0
