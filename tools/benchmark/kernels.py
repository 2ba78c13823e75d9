"""Each kernel alone: instructions for an element on host builds and on an emulated target, and one hash on all of them.

An element is a number drawn, a function evaluated, or a particle. The host's counts are callgrind's; the target's those
of the plugin of tools/targets. tools/bench kernels --check looks whether loops vectorised (see CAN_VECTORISE)."""
import subprocess

import flight
import machines
import measure
from measure import Failure

ELEMENTS = 1024
SYSTEMS = [machine.name for machine in machines.ALL if machine.system]
WHAT = {
    "uniform_single": "32 random bits, from the stream for single draws", "uniform_lanes": "32 random bits, from the eight streams",
    "normals": "standard normal", "exp": "pfl_expf_n", "log": "pfl_logf_n", "sincos": "pfl_sincosf_n", "atan2": "pfl_atan2f_n",
    "one_constant_velocity": "constant_velocity, written for one particle (per_particle.h)",
    "one_land_vehicle": "land_vehicle, written for one particle, with a call of pfl_sincosf",
    "one_position": "position, written for one particle",
    "marginal_shared": "two linear states drive two, none seen (marginal.h)", "marginal_shared_seen": "two drive one, and are seen",
    "marginal_each_seen": "the same with a covariance each", "terrain": "its lookups in the grid are scalar",
    "wind": "the marginalised filter's predict, with a fix to move in (wind.h)", "wind_fix": "its log-likelihood",
    "hover": "three axes, one bias", "biased": "six components, one with a bias", "clocks_four": "two clocks carried along, four ranges fused",
    "pseudorange_four": "four ranges with a tail", "range_bias_correct": "a range's bias moved in", "range_bias": "Student's t",
    "road_network": "7 states; each particle on an edge of its own", "law_student": "a scalar and its bias (errors.h)",
    "law_mixture": "the same, with a flat part", "law_split": "the same, by sides", "drift": "one state about constant_velocity",
    "jump": "two models of constant_velocity, moved to their neighbours and back", "proposal": "constant_velocity given a position",
    "predict": "a whole pfl_predict, 4 states, 2 noises", "update": "a whole pfl_update, 2 states seen, no resampling",
    "mean": "normalise, effective sample size, mean", "mean_covariance": "the same with the covariance",
    "mean_circular": "the same without it, one state an angle", "resample_equal": "running sums and offspring alone: nothing to copy",
    "resample_systematic": "weights of usual spread", "resample_degenerate": "few particles have all the weight",
}
# By at least how much fewer instructions the vector build (x86-64-v3, 8 lanes) must take than one compiled without
# vectorisation. A loop that did not vectorise stands at 1.0; one that did loses some of 8 to loads, tails and set-up.
CAN_VECTORISE = {
    "normals": 5.0, "exp": 5.0, "log": 5.0, "sincos": 5.0, "atan2": 5.0,
    "land_vehicle": 4.0, "land_vehicle_jitter": 4.0, "constant_velocity": 3.0, "constant_velocity_walk": 3.0, "odometry": 4.0,
    "road_target": 4.0, "lane_target": 3.0, "planar_uav": 4.0, "planar_uav_euler": 4.0, "autopilot": 4.0, "autopilot_wind": 4.0,
    "coast": 3.0, "turn": 4.0, "turn_redraw": 3.0,
    "position": 3.0, "position_one": 3.0, "position_distance": 4.0, "range": 3.0, "range_student": 4.0, "range_bearing": 4.0,
    "coloured": 3.0, "velocity": 4.0, "dead_reckoning_rest": 2.0, "marginal_shared": 2.0, "marginal_shared_seen": 2.0,
    "marginal_each_seen": 1.8, "terrain": 1.5,
    "wind_fix": 4.0, "hover": 4.0, "biased": 3.0, "wheels": 4.0, "clocks_four": 4.0, "pseudorange_four": 4.0, "range_bias_correct": 4.0,
    "range_bias": 4.0, "law_student": 4.0, "law_mixture": 4.0, "law_split": 4.0, "drift": 3.0, "proposal": 3.0,
    "one_constant_velocity": 3.0, "one_position": 3.0, "mean": 3.0, "mean_covariance": 3.0, "mean_circular": 3.0,
}
# autopilot_route looks up each particle's waypoint, road_network its edge; one_land_vehicle and wind call a function for each, of
# sine and cosine; jump moves particles to their regime's neighbours one by one; the eight streams alone are
# so short a loop that gcc 12 makes scalars of it here, other than in the generator of normals.
CANNOT = ["autopilot_route", "road_network", "one_land_vehicle", "wind", "jump", "uniform_lanes"]
SCALAR = "-fno-tree-vectorize"


def add_options(parser):
    parser.add_argument("--target", choices=SYSTEMS, default="cortex-m4f", help="the emulated one (default: cortex-m4f)")
    parser.add_argument("--host-only", action="store_true", help="no emulation")
    parser.add_argument("--check", action="store_true", help="did the loops vectorise? exit 1 when one did not")
    measure.add_json(parser)


def on_host(build, flags=""):
    """Of each kernel its hash and its instructions for an element."""
    said, profile = measure.callgrind([str(measure.built("kernels", build, flags))], [])
    return {name: (hash_, profile.into(f"kernel_{name}") / ELEMENTS) for name, hash_ in said.items()}


def on_target(machine):
    for tool in (machine.emulator[0], machine.prefix + "gcc"):
        measure.need(tool, "target")
    folder = measure.OUT / machine.name
    flight.configure_and_build(folder, "kernels", [
        "-DPFLIGHT_BUILD_TOOLS=OFF", "-DPFLIGHT_BUILD_IMAGES=ON", "-DCMAKE_BUILD_TYPE=Release",
        f"-DCMAKE_TOOLCHAIN_FILE=tools/targets/toolchain/{machine.name}.cmake"])
    image, log = folder / "tools/benchmark/kernels", folder / "calls.txt"
    where = {name: at for name, at in flight.addresses(machine, image).items() if name.startswith("kernel_")}
    where.pop("kernel_data", None)
    said, counts = {}, {}
    names = sorted(where)
    for some in (names[k:k + 30] for k in range(0, len(names), 30)):  # the plugin marks at most 32
        calls = [f"call={name}@{where[name]}" for name in some]
        plug = ",".join([str(flight.plugin()), f"out={log}", f"from={flight.addresses(machine, image)['main']}", *calls])
        if some:
            said = measure.pairs_of(["timeout", "300", *machine.command(image, plug)])
            for line in log.read_text().splitlines():
                pairs = dict(pair.split("=") for pair in line.split())
                counts[pairs["call"][7:]] = int(pairs["instructions"]) / ELEMENTS
    return {name: (hash_, counts[name]) for name, hash_ in said.items()}


def figures(options):
    columns = {build: on_host(build) for build in measure.BUILDS}
    if not options.host_only:
        columns[options.target] = on_target(machines.find(options.target))
    rows, agree = {}, True
    for name, (hash_, _) in columns["x86-64"].items():
        same = len({column[name][0] for column in columns.values()}) == 1
        agree = agree and same
        rows[name] = {"what": WHAT.get(name, "a particle"), "hash": hash_, "same_bits": same,
                      "instructions": {where: round(column[name][1], 2) for where, column in columns.items()}}
    return {"schema": 1, "benchmark": "kernels", "compiler": measure.compiler(), "elements": ELEMENTS,
            "instructions_not_cycles": True, "all_agree": agree, "kernels": rows}


def show(result):
    where = list(next(iter(result["kernels"].values()))["instructions"])
    print(f"instructions (not cycles) for an element, {result['elements']} elements, {result['compiler']} -O3\n")
    print(f"{'kernel':<23s}" + "".join(f"{name:>12s}" for name in where) + "  hash")
    for name, row in result["kernels"].items():
        counts = "".join(f"{row['instructions'][column]:12.2f}" for column in where)
        print(f"{name:<23s}{counts}  {row['hash'] if row['same_bits'] else 'DIFFERS '}  {row['what']}")
    print("\nthe same bits on all" if result["all_agree"] else "\nNOT the same bits")


# ---- Did the loops vectorise? -------------------------------------------------------------------------------------------


def check():
    vector, scalar = on_host("x86-64-v3"), on_host("x86-64-v3", SCALAR)
    unknown = [name for name in vector if name not in CAN_VECTORISE and name not in CANNOT
               and not name.startswith(("uniform_single", "predict", "update", "resample_"))]
    bad = [f"{name}: say in tools/benchmark/kernels.py whether it vectorises" for name in unknown]
    print(f"{'loop':<23s}{'vector':>10s}{'scalar':>10s}{'ratio':>8s}{'wanted':>8s}")
    for name, wanted in CAN_VECTORISE.items():
        ratio = scalar[name][1] / vector[name][1]
        print(f"{name:<23s}{vector[name][1]:10.2f}{scalar[name][1]:10.2f}{ratio:8.2f}{wanted:8.1f}")
        if ratio < wanted:
            bad.append(f"{name}: {ratio:.2f} times fewer instructions as vectors, at least {wanted:g} wanted: it did not vectorise")
        if scalar[name][0] != vector[name][0]:
            bad.append(f"{name}: vector and scalar builds differ in their bits")
    for line in bad:
        print(f"bench: {line}")
    return 1 if bad else 0


def run(options):
    if options.check:
        return check()
    try:
        result = figures(options)
    except subprocess.SubprocessError as error:
        raise Failure(str(error)) from error
    measure.deliver(result, options, show)
    return 0 if result["all_agree"] else 1
