"""A scenario on one machine: record it on the host, build and run the player, count, compare."""
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess

import machines
from machines import ROOT

BUILD = ROOT / "build/target"
RUN_SECONDS = 300
# What the plugin counts: calls of the player, and parts inside of them.
CALLS = {
    "pfl_init": "init", "pfl_predict": "predict", "pfl_update": "update", "pfl_estimate": "estimate",
    "pfl_resample": "resample", "pfl_farthest": "answers", "pfl_forecast": "forecast", "pfl_standoff_step": "guidance",
    "pfl_lvfg_command": "guidance", "pfl_nmpc_solve": "guidance",
}
PARTS = {"normalise": "pfl_moments", "resample": "pfl_resample_now"}
STAGES = ["predict", "update", "normalise", "estimate", "resample", "answers", "forecast", "guidance"]
# Operations of tape.ticks, as in tape.h.
OPERATIONS = {1: "pfl_init", 2: "pfl_predict", 3: "pfl_update", 4: "pfl_estimate", 5: "pfl_resample", 6: "pfl_farthest",
              8: "pfl_forecast", 9: "pfl_standoff_step", 10: "pfl_lvfg_command", 11: "pfl_nmpc_solve"}
PARTICLE_FILTER = {"gps": "pf"}  # where the scenario's default is another kind of filter


class Failure(Exception):
    """Something that is not the library's fault: a tool is missing, a build failed."""

    def __init__(self, text, status=3):
        super().__init__(text)
        self.status = status


class NoTape(Failure):
    """A study that the recorder cannot put on a tape (record.c)."""


# ---- Builds ------------------------------------------------------------------------------------------------------------


def checked(command, log, **more):
    with open(log, "ab") as file:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT, check=False, **more)
    if done.returncode != 0:
        tail = pathlib.Path(log).read_text(errors="replace").splitlines()[-20:]
        raise Failure("\n".join([*tail, f"{command[0]} failed; the whole log: {os.path.relpath(log, ROOT)}"]))


def configure_and_build(folder, target, arguments):
    """Builds from nothing when the arguments or the toolchain file changed: CMake keeps old flags otherwise."""
    stamp, log = folder / "configured-with.txt", folder / "build.log"
    toolchain = [ROOT / a.split("=", 1)[1] for a in arguments if a.startswith("-DCMAKE_TOOLCHAIN_FILE=")]
    wanted = "\n".join(arguments + [path.read_text() for path in toolchain])
    if not stamp.exists() or stamp.read_text() != wanted:
        shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    log.write_text("")
    if not stamp.exists():
        checked(["cmake", "-S", str(ROOT), "-B", str(folder), "-DPFLIGHT_BUILD_TESTS=OFF", "-DPFLIGHT_BUILD_EXAMPLES=OFF",
                 *arguments], log)
        stamp.write_text(wanted)
    checked(["cmake", "--build", str(folder), "--target", target, "-j", str(os.cpu_count())], log)


_built = {}


def build_once(key, make):
    if key not in _built:
        _built[key] = make()
    return _built[key]


def need(command, package_group="target"):
    if shutil.which(command) is None:
        raise Failure(f"{command} is missing: tools/setup {package_group}")


def recorder():
    def make():
        need("cmake", "run")
        folder = BUILD / "host"
        configure_and_build(folder, "pflight_record", ["-DCMAKE_BUILD_TYPE=Release", "-DPFLIGHT_BUILD_TOOLS=ON"])
        return folder / "tools/targets/pflight_record"
    return build_once("record", make)


def plugin():
    def make():
        path = BUILD / "count.so"
        BUILD.mkdir(parents=True, exist_ok=True)
        checked(["gcc", "-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC",
                 str(ROOT / "tools/targets/plugin/count.c"), "-o", str(path)], BUILD / "plugin.log")
        return path
    return build_once("plugin", make)


def player(machine, optimise, defines=()):
    """The image that plays a tape; `defines` (-D...) are for the library and make it a build of its own."""
    def make():
        if machine.emulator:
            need(machine.emulator[0])
            need(machine.prefix + "gcc")
        folder = BUILD / (f"{machine.name}-{optimise}" if machine.toolchain else machine.name)
        folder = folder.with_name(folder.name + re.sub(r"[^A-Z0-9]+", "", "".join(defines)))
        arguments = ["-DPFLIGHT_BUILD_TOOLS=OFF", "-DPFLIGHT_BUILD_IMAGES=ON", "-DPFLIGHT_WERROR=ON", *machine.cmake]
        if machine.toolchain:
            arguments.append(f"-DCMAKE_TOOLCHAIN_FILE=tools/targets/toolchain/{machine.name}.cmake")
            arguments += ["-DCMAKE_BUILD_TYPE=Release"] if optimise == "O3" and not defines else [
                "-DCMAKE_BUILD_TYPE=None", f"-DCMAKE_C_FLAGS_NONE={' '.join([f'-{optimise}', *defines])}"]
        configure_and_build(folder, "pflight_replay", arguments)
        return folder / "tools/targets/pflight_replay"
    return build_once((machine.name, optimise, tuple(defines)), make)


# ---- The tape ------------------------------------------------------------------------------------------------------------


def words(path):
    data = path.read_bytes()
    return struct.unpack(f"<{len(data) // 4}I", data)


def record(scenario, options, folder):
    """Flies the scenario on the host with the tape running; returns what the runner says of it."""
    command = [str(recorder()), scenario, "--runs", "1", "--threads", "1", "--seed", str(options.seed), "--json", "-"]
    command += ["--particles", str(options.particles)] if options.particles else []
    wanted = options.filter or PARTICLE_FILTER.get(scenario)
    command += ["--filter", wanted] if wanted else []
    for setting in options.set:
        command += ["--set", setting]
    return runner(command, folder, PFLIGHT_TAPE="host")


def runner(command, folder, **environment):
    done = subprocess.run(command, cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL, check=False)
    if done.returncode not in (0, 1):  # 1: outside the acceptance, which a single run may be
        kind = NoTape if done.returncode == 4 else Failure
        raise kind(done.stderr.strip() or f"{command[0]} ended with {done.returncode}", done.returncode)
    return command, json.loads(done.stdout)


def add_noise(parser):
    parser.add_argument("--noise", choices=["own", "antithetic"], default="own",
                        help="each particle's own, or antithetic (pflight/antithetic.h)")


def write_tape(recorded, path, options):
    """The recorded tape with the wanted changes in its head."""
    data = bytearray(recorded.read_bytes())
    struct.pack_into("<I", data, 4, options.steps or 0)
    if options.ess_ratio is not None:
        struct.pack_into("<f", data, 8, options.ess_ratio)
    if options.sharpen is not None:
        struct.pack_into("<f", data, 12, options.sharpen)
    struct.pack_into("<I", data, 16, options.noise == "antithetic")
    path.write_bytes(data)


# ---- The flight ------------------------------------------------------------------------------------------------------------


def play(machine, image, folder, plug=None):
    """Runs the player in its folder; its line as a dictionary."""
    done = subprocess.run(["timeout", str(RUN_SECONDS), *machine.command(image, plug)], cwd=folder, capture_output=True,
                          text=True, stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        raise Failure(f"{machine.name}: the player ended with {done.returncode}: "
                      f"{(done.stdout + done.stderr).strip() or 'without a word'}")
    return dict(pair.split("=") for pair in done.stdout.split())


def addresses(machine, image):
    lines = subprocess.run([machine.prefix + "nm", "--synthetic", str(image)], check=True, capture_output=True, text=True).stdout
    table = {}
    for address, kind, name in re.findall(r"^([0-9a-f]+) (\w) (\S+)$", lines, re.M):
        # On big-endian PowerPC a function's name is that of its descriptor; .name or L.name is its code.
        if kind in "tT" or name not in table:
            table[name] = address
    return {name: table.get("." + name, table.get("L." + name, address)) for name, address in table.items()}


def plug_arguments(machine, image, log):
    where = addresses(machine, image)
    parts = [f"part={stage}@{where[name]}" for stage, name in PARTS.items()]
    calls = [f"call={name}@{where[name]}" for name in CALLS if name in where]
    return ",".join([str(plugin()), f"out={log}", f"blocks={log}.blocks", f"from={where['io_open']}", *calls, *parts])


HEAD_WORDS = 5  # TAPE_HEAD_WORDS; an operation, the particles and the rest of the configuration follow
COUNTER_SLACK = 32  # instructions between the port's reading of its counter and the call


def count_cycles(log, ticks, per_instruction):
    """Cycles as dictionaries of instructions by stage, with what the plugin tells of them. The port's own counter, where
    there is one, must say the same of every call."""
    cycles, resampled = [], 0
    lines = [dict(pair.split("=") for pair in line.split()) for line in log.read_text().splitlines()]
    counted = [(OPERATIONS[t[0]], t) for t in ticks if t[0] in OPERATIONS]
    if [line["call"] for line in lines] != [name for name, _ in counted]:
        raise Failure("the plugin's calls are not those of the player")
    for line, (name, tick) in zip(lines, counted):
        if per_instruction and abs(tick[1] / per_instruction - int(line["instructions"])) > COUNTER_SLACK:
            raise Failure(f"{name}: the port counts {tick[1] / per_instruction:.0f} instructions, the plugin "
                          f"{line['instructions']}", 1)
        if name == "pfl_init":
            resampled = 0
            continue
        if name == "pfl_predict":
            cycles.append({"stages": dict.fromkeys(STAGES, 0), "classes": {}, "low": 0, "high": 0, "updates": 0,
                           "resamples": False})
        if not cycles:
            continue
        cycle, stages = cycles[-1], cycles[-1]["stages"]
        parts = {stage: int(line[stage]) for stage in PARTS}
        stages[CALLS[name]] += int(line["instructions"]) - sum(parts.values())
        for stage, count in parts.items():
            stages[stage] += count
        for key, value in line.items():
            if key.startswith("class_"):
                cycle["classes"][key[6:]] = cycle["classes"].get(key[6:], 0) + int(value)
        low, _, high = line.get("estimated_m4_cycles", "0..0").partition("..")
        cycle["updates"] += name == "pfl_update"
        cycle["low"] += int(low)
        cycle["high"] += int(high)
        cycle["resamples"] = cycle["resamples"] or tick[3] > resampled
        resampled = tick[3]
    return cycles


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else 0.0


def summarise(cycles, particles):
    totals = [sum(cycle["stages"].values()) for cycle in cycles]
    most = max(cycle["updates"] for cycle in cycles)  # like is compared with like: cycles with all measurements
    full = [(total, cycle["resamples"]) for total, cycle in zip(totals, cycles) if cycle["updates"] == most]
    resampling = [total for total, resamples in full if resamples]
    plain = [total for total, resamples in full if not resamples]
    return {
        "instructions": {"min": min(totals), "mean": mean(totals), "max": max(totals),
                         "per_particle_step": mean(totals) / particles},
        "stages": {stage: mean(cycle["stages"][stage] for cycle in cycles) for stage in STAGES
                   if any(cycle["stages"][stage] for cycle in cycles) or stage in STAGES[:5]},
        "resampling": {"cycles": len(resampling), "mean": mean(resampling), "max": max(resampling, default=0),
                       "plain_mean": mean(plain), "plain_max": max(plain, default=0),
                       "ratio": mean(resampling) / mean(plain) if plain and resampling else None},
        "class_mix": {name: mean(cycle["classes"][name] for cycle in cycles) for name in cycles[0]["classes"]},
        "estimated_m4_cycles": [mean(cycle["low"] for cycle in cycles), mean(cycle["high"] for cycle in cycles)],
    }


def count(machine, image, folder, particles, ticks):
    nothing = {"instructions": None, "stages": {}, "resampling": {}, "class_mix": {}, "estimated_m4_cycles": [0, 0]}
    if not machine.emulator:
        return nothing
    before = (folder / "tape.out").read_bytes()
    play(machine, image, folder, plug_arguments(machine, image, folder / "calls.txt"))
    if (folder / "tape.out").read_bytes() != before:
        raise Failure(f"{machine.name}: two plays of one tape differ", 1)
    return summarise(count_cycles(folder / "calls.txt", ticks, machine.ticks), particles)


def compiler_of(machine):
    command = machine.prefix + "gcc" if machine.emulator else machine.cmake[0].split("=")[1]
    line = subprocess.run([command, "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]
    return f"{command} {re.search(r'([0-9]+[.][0-9]+[.][0-9]+)', line).group(1)}"


def play_here(folder, options):
    here = folder / "here"
    here.mkdir()
    shutil.copy(folder / "tape.in", here)
    machine = machines.find("host-gcc-O3")
    line = play(machine, player(machine, options.optimise), here)
    return (here / "tape.out").read_bytes(), line


def fly(scenario, machine, options, counted=True):
    folder = BUILD / "flights" / f"{machine.name}-{options.optimise}" / scenario
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    command, said = record(scenario, options, folder)
    if not (folder / "host.in").exists():
        raise Failure(f"{scenario} makes no call to the library with these settings: choose a particle filter, --filter", 2)
    image = player(machine, options.optimise, getattr(options, "defines", ()))
    write_tape(folder / "host.in", folder / "tape.in", options)
    line = play(machine, image, folder)
    ours, host = (folder / "tape.out").read_bytes(), (folder / "host.out").read_bytes()
    as_flown = options.ess_ratio is None and options.sharpen is None and options.noise == "own" and (not options.steps or len(ours) == len(host))
    result = {
        "schema": 1, "scenario": scenario, "target": machine.name, "compiler": compiler_of(machine),
        "optimisation": f"-{options.optimise}" if machine.toolchain else machine.what.split(", ")[1],
        "particles": words(folder / "host.in")[HEAD_WORDS + 1], "steps": int(line["cycles"]), "instructions_not_cycles": True,
        "arena_bytes": int(line["arena"]),
    }
    if not as_flown:  # not what the runner flew: the player on this machine flies it too, from the same tape
        theirs, their_line = play_here(folder, options)
        result |= {"hash": line["hash"], "host_hash": their_line["hash"], "same_bits": ours == theirs}
    elif ours == host:  # the runner again, on the target's answers: its hash is that of the target's estimates
        _, replayed = runner(command, folder, PFLIGHT_TAPE_PLAY=str(folder / "tape.out"))
        result |= {"hash": replayed["hash"], "host_hash": said["hash"], "same_bits": replayed["hash"] == said["hash"]}
    else:
        result |= {"hash": line["hash"], "host_hash": said["hash"], "same_bits": False}
    ticks = words(folder / "tape.ticks")
    ticks = [ticks[i:i + 4] for i in range(0, len(ticks), 4)]
    stack = {}
    for operation, _, used, _ in ticks:
        name = OPERATIONS[operation]
        stack[name] = max(stack.get(name, 0), used)
    result["stack_bytes"] = stack
    result |= count(machine, image, folder, result["particles"], ticks) if counted else {}
    return result
