"""One run of a scenario, all of it on an emulated Cortex-M4F, M7 or M55: for scenarios whose callbacks and structures no tape holds.

The image is the scenario runner itself with newlib (whole/main.c): it reads the recordings, makes the truth, flies the
filters and hashes their estimates, as tools/run does on the host. So the board is one of Arm's with 16 MB of external RAM
(machines.LARGE), and what only fits there (the map of `terrain`, the recordings) says nothing about an STM32F405; the filter's arena is
told. Calls of the library are counted by the plugin, the scenario's own code is not."""
import os
import re
import shutil
import subprocess

import flight
import machines
from machines import LARGE, ROOT

RUN_SECONDS = 600
# Calls beside those of flight.CALLS, and the stage that they belong to.
CALLS = flight.CALLS | {
    "pfl_tempered_update": "update", "pfl_auxiliary_look": "predict", "pfl_adapt": "resample", "pfl_jump_resample": "resample",
    "pfl_jump_probabilities": "answers", "pfl_marginal_shared_step": "predict", "pfl_wind_move": "predict",
    "pfl_wind_weigh": "update", "pfl_wind_fuse": "update", "pfl_clocks_fused": "update", "pfl_range_bias_move": "predict",
    "pfl_range_bias_fused": "update", "pfl_fork": "forecast",
}
# Scenarios that fly several filters, one after the other; a pfl_init begins each.
FILTERS = {
    "sharp": ["bootstrap", "bootstrap-10n", "tempered", "auxiliary", "optimal", "adapted"],
    "manoeuvre": ["calm", "wild", "one", "two-bare", "two"],
    "road-network": ["free", "annulus", "one", "two"],
}


def image(board, target):
    """An image of whole/CMakeLists.txt: whole_run or whole_bits."""
    def make():
        flight.need(board.emulator[0])
        flight.need(board.prefix + "gcc")
        folder = flight.BUILD / board.name
        flight.configure_and_build(folder, target, [
            "-DPFLIGHT_BUILD_TOOLS=OFF", "-DPFLIGHT_BUILD_WHOLE=ON", "-DCMAKE_BUILD_TYPE=Release",
            f"-DCMAKE_TOOLCHAIN_FILE=tools/targets/toolchain/{board.name}.cmake"])
        return folder / "tools/targets/whole" / target
    return flight.build_once((board.name, target), make)


def host_runner():
    def make():
        flight.need("cmake", "run")
        folder = flight.BUILD / "host"
        flight.configure_and_build(folder, "pflight_run", ["-DCMAKE_BUILD_TYPE=Release", "-DPFLIGHT_BUILD_TOOLS=ON"])
        return folder / "tools/pflight_run"
    return flight.build_once("host runner", make)


def plug(board, program, log):
    where = flight.addresses(board, program)
    parts = [f"part={stage}@{where[name]}" for stage, name in flight.PARTS.items()]
    calls = [f"call={name}@{where[name]}" for name in CALLS if name in where]
    return ",".join([str(flight.plugin()), f"out={log}", f"from={where['main']}", *calls, *parts])


def fly_there(board, arguments, folder):
    """The run on the emulated board: its line as (key, value) pairs. The plugin's log is left in the folder."""
    program = image(board, "whole_run")
    (folder / "arguments").write_text("".join(f"{word}\n" for word in arguments))
    command = board.command(program, plug(board, program, folder / "calls.txt"))
    done = subprocess.run(["timeout", str(RUN_SECONDS), *command], cwd=folder, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        raise flight.Failure(f"{board.name}: {(done.stdout + done.stderr).strip() or done.returncode}")
    return [tuple(pair.split("=")) for pair in done.stdout.split()]


# ---- Cycles ----------------------------------------------------------------------------------------------------------------


def empty_cycle():
    return {"stages": dict.fromkeys(flight.STAGES, 0), "classes": {}, "low": 0, "high": 0, "updates": 0, "resamples": False}


def add_call(cycle, line):
    parts = {stage: int(line[stage]) for stage in flight.PARTS}
    cycle["stages"][CALLS[line["call"]]] += int(line["instructions"]) - sum(parts.values())
    for stage, count in parts.items():
        cycle["stages"][stage] += count
    for key, value in line.items():
        if key.startswith("class_"):
            cycle["classes"][key[6:]] = cycle["classes"].get(key[6:], 0) + int(value)
    low, _, high = line.get("estimated_m4_cycles", "0..0").partition("..")
    cycle["low"] += int(low)
    cycle["high"] += int(high)
    cycle["updates"] += line["call"] in ("pfl_update", "pfl_tempered_update")
    cycle["resamples"] = cycle["resamples"] or parts["resample"] > 0


def read_cycles(log):
    """Cycles of each filter. One begins with pfl_predict, or with what stands before it; pfl_fork looks ahead, in cycles
    of its own."""
    filters, ahead = [[]], False
    for text in log.read_text().splitlines():
        line = dict(pair.split("=") for pair in text.split())
        if line["call"] == "pfl_init":
            filters.append([])
        elif line["call"] in ("pfl_predict", "pfl_fork", "pfl_auxiliary_look"):
            if not (line["call"] == "pfl_predict" and ahead):
                filters[-1].append(empty_cycle())
            ahead = line["call"] == "pfl_auxiliary_look"
        if filters[-1] and line["call"] != "pfl_init":
            add_call(filters[-1][-1], line)
    return filters[1:]


def name_of_filter(scenario, wanted):
    """Which of the filters that a scenario flies in turn is counted: the last unless said; None where it flies one."""
    names = FILTERS.get(scenario)
    if names is None and wanted:
        raise flight.Failure(f"{scenario} flies one filter; --part is for {', '.join(FILTERS)}", 2)
    if names is not None and wanted and wanted not in names:
        raise flight.Failure(f"{scenario} flies no filter '{wanted}' but {', '.join(names)}", 2)
    return wanted or (names and names[-1])


def chosen(scenario, filters, name):
    """The cycles to count, with an update each, and the number of their filter among all of the run."""
    at = FILTERS[scenario].index(name) if name else 0
    cycles = filters[at] if name else [cycle for each in filters for cycle in each]
    return [cycle for cycle in cycles if cycle["updates"]], at


# ---- The flight ---------------------------------------------------------------------------------------------------------------


def arguments_of(scenario, options):
    data = os.environ.get("PFLIGHT_DATA") or str(ROOT.parent / "shared/data")
    words = [scenario, "--runs", "1", "--threads", "1", "--seed", str(options.seed), "--data", os.path.realpath(data)]
    words += ["--particles", str(options.particles)] if options.particles else []
    wanted = options.filter or flight.PARTICLE_FILTER.get(scenario)
    words += ["--filter", wanted] if wanted else []
    for setting in options.set:
        words += ["--set", setting]
    return words


def fly(scenario, machine, options):
    """From a tape where there is one, as the STM32F405 and all other machines can; else the whole run, where it can."""
    if not getattr(options, "whole", False) and not getattr(options, "part", None):
        try:
            return flight.fly(scenario, machine, options)
        except flight.NoTape as reason:
            if machine.name not in LARGE:
                raise flight.Failure(f"{reason}; such a run flies on {', '.join(LARGE)} only", 2) from None
    if machine.name not in LARGE:
        raise flight.Failure(f"--whole and --part are for --target {', '.join(LARGE)}", 2)
    return fly_whole(scenario, LARGE[machine.name], options)


def fly_whole(scenario, board, options):
    for_tapes = (options.steps, options.ess_ratio, options.sharpen) != (None, None, None)
    if for_tapes or options.noise != "own" or options.optimise != "O3":
        raise flight.Failure(f"{scenario} flies as a whole here: --steps, --ess-ratio, --sharpen, --noise and --optimise are for tapes", 2)
    name = name_of_filter(scenario, getattr(options, "part", None))
    folder = flight.BUILD / "flights" / board.name / scenario
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    words = arguments_of(scenario, options)
    _, said = flight.runner([str(host_runner()), *words, "--json", "-"], folder)
    pairs = fly_there(board, words, folder)
    filters = [tuple(map(int, value.split(":"))) for key, value in pairs if key == "filter"]
    line = dict(pairs)
    cycles, at = chosen(scenario, read_cycles(folder / "calls.txt"), name)
    if not cycles:
        raise flight.Failure(f"{scenario} makes no update with these settings: choose a particle filter, --filter", 2)
    particles, arena = filters[at]
    return {
        "schema": 1, "scenario": scenario, "target": board.name, "compiler": flight.compiler_of(board), "optimisation": "-O3",
        "particles": particles, "steps": len(cycles), "instructions_not_cycles": True, "arena_bytes": arena, "part": name,
        "whole": True, "hash": line["hash"], "host_hash": said["hash"], "same_bits": line["hash"] == said["hash"], "stack_bytes": {},
    } | flight.summarise(cycles, particles)
