"""The same filter by other libraries, on the same recorded work: instructions, nanoseconds, error.

The work (tools/benchmark/peers/work.h): 20 recorded flights of 100 steps, 4 states, 2 normals and 3 Gaussian measurements
a particle, N = 1000, mean in every step, resampling below an effective sample size of N/2, known start. Each peer is a
program of ours of some 100 lines on the library as it is installed; instructions are callgrind's for the first flight,
inside of the filter cycle; times are the least over rounds in which all peers take turns in the same order. A peer whose
error is not within 10 % of ours has not done the same work, and does not count."""
import dataclasses
import os
import re
import shutil
import subprocess

import measure
from measure import OUT, ROOT, Failure

HERE = ROOT / "tools/benchmark/peers"
WORK = OUT / "peers"
MARCH = "-march=x86-64-v3"
C = ["gcc", "-std=gnu99", "-O3", MARCH]
CXX = ["g++", "-std=c++17", "-O3", MARCH]
MRPT_PARTS = ["bayes", "config", "containers", "core", "expr", "math", "random", "rtti", "serialization", "system", "typemeta"]
MRPT = [f"-I/usr/include/mrpt/{part}/include" for part in MRPT_PARTS] + ["-I/usr/include/eigen3"]
PARTICLES, FLIGHTS, ROUNDS = 1000, 20, 3
WITHIN = 0.10  # of our RMSE


@dataclasses.dataclass(frozen=True)
class Peer:
    name: str
    language: str
    build: tuple = ()  # command; {out} is the program
    debian: str = ""  # package
    python: str = ""
    rust: str = ""  # feature; "-": none
    library: bool = True  # else a program of ours
    note: str = ""

    @property
    def native(self):
        return not self.python

    @property
    def program(self):
        return WORK / re.sub(r"[^a-z0-9]+", "_", self.name.lower())


PEERS = [
    Peer("pflight", "C99", library=False, note="this library, single precision, strict IEEE"),
    Peer("textbook C, float", "C", (*C, "-DREAL=float", "{here}/textbook.c", "-o", "{out}", "-lm"), library=False,
         note="ours: array of structures, C library"),
    Peer("textbook C, double", "C", (*C, "-DREAL=double", "{here}/textbook.c", "-o", "{out}", "-lm"), library=False,
         note="ours: the same"),
    Peer("multicalc, f32", "Rust", rust="single", note="4 normals, not 2: its noise covers every state; mean after resampling"),
    Peer("multicalc, f64", "Rust", rust="-", note="the same"),
    Peer("MRPT", "C++", (*CXX, *MRPT, "{here}/mrpt.cpp", "-o", "{out}", "-lmrpt-bayes", "-lmrpt-random", "-lmrpt-system",
                         "-lmrpt-core", "-lmrpt-config"), debian="libmrpt-bayes-dev",
         note="double; mean after resampling; weights set equal by us after its resampling, which keeps the old ones"),
    Peer("Orocos BFL", "C++", (*CXX, "-I/usr/include/bfl", "-I/usr/include", "{here}/bfl.cpp", "-o", "{out}", "-lorocos-bfl"),
         debian="liborocos-bfl-dev", note="double; multinomial, the only scheme it has; mean after resampling"),
    Peer("numpy + filterpy", "Python", python="filterpy", note="double; filterpy's systematic resampler, the loop is ours"),
    Peer("particles", "Python", python="particles", note="double; computes the variances too"),
    Peer("pfilter", "Python", python="pfilter", note="double; computes a covariance and an entropy too"),
]
LEFT_OUT = ("Beluga, tbrown122387/pf, nav2's AMCL, mikropf and other filters that no registry offers as a package are not in "
            "this table.")


def add_options(parser):
    parser.add_argument("--no-install", action="store_true", help="use what is there; what is missing is marked")
    measure.add_json(parser)


# ---- Installation ---------------------------------------------------------------------------------------------------------


def logged(command, log, what, **more):
    with open(log, "ab") as file:
        done = subprocess.run([str(part) for part in command], stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                              check=False, **more)
    if done.returncode != 0:
        raise Failure(f"{what}: see {os.path.relpath(log, ROOT)}")


def debian_version(package):
    done = subprocess.run(["dpkg-query", "-W", "-f", "${db:Status-Status} ${Version}", package], capture_output=True, text=True,
                          check=False)
    status, _, version = done.stdout.partition(" ")
    return version if status == "installed" else None


def install_debian(package, allowed, log):
    measure.need("dpkg-query")
    if debian_version(package) is None and allowed:
        if os.geteuid() != 0:
            raise Failure(f"apt-get install {package}, as root")
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        apt = ["apt-get", "-o", "DPkg::Lock::Timeout=500", "-qq"]
        logged([*apt, "update"], log, "apt-get update failed", env=environment)
        logged([*apt, "install", "-y", "--no-install-recommends", package], log, f"apt-get cannot install {package}", env=environment)
    version = debian_version(package)
    if version is None:
        raise Failure(f"the package {package} is not installed")
    return f"Debian {package} {version}"


def python_version(peer, allowed, log):
    venv, wanted = WORK / "venv", HERE / "requirements.txt"
    stamp = venv / "installed.txt"
    if not (stamp.exists() and stamp.read_text() == wanted.read_text()):
        if not allowed:
            raise Failure(f"PyPI {peer.python} is not installed")
        logged(["python3", "-m", "venv", "--clear", venv], log, "python3 -m venv failed")
        logged([venv / "bin/pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", "numpy,scipy,numba,scikit-learn",
                "-r", wanted], log, "pip cannot install the Python peers")
        stamp.write_text(wanted.read_text())
    code = f"import importlib.metadata as m; print(m.version('{peer.python}'), m.version('numpy'))"
    version, numpy = measure.output_of([venv / "bin/python", "-c", code]).split()
    return f"PyPI {peer.python} {version}, numpy {numpy}"


def build_rust(peer, allowed, log):
    if shutil.which("cargo") is None:
        raise Failure("cargo is missing (multicalc needs Rust 1.85; Debian 12's is older)")
    folder, target = WORK / "multicalc", WORK / "multicalc" / f"target-{peer.rust}"
    shutil.copytree(HERE / "multicalc", folder, dirs_exist_ok=True)
    command = ["cargo", "build", "--release", "--target-dir", target]
    command += ["--features", peer.rust] if peer.rust != "-" else []
    command += [] if allowed else ["--offline"]
    logged(command, log, "cargo build failed", cwd=folder, env={**os.environ, "RUSTFLAGS": "-C target-cpu=x86-64-v3"})
    shutil.copy(target / "release/multicalc_peer", peer.program)
    version = re.search(r'name = "multicalc"\nversion = "([^"]+)"', (folder / "Cargo.lock").read_text())[1]
    rust = measure.output_of(["rustc", "--version"]).split()[1]
    return f"crates.io multicalc {version}, rustc {rust}"


def prepare(peer, allowed):
    """Installs and builds; what its version is."""
    log = WORK / f"{peer.program.name}.log"
    log.write_text("")
    if peer.python:
        return python_version(peer, allowed, log)
    if peer.rust:
        return build_rust(peer, allowed, log)
    if peer.name == "pflight":
        shutil.copy(measure.built("peer_pflight"), peer.program)
        return measure.compiler()
    version = install_debian(peer.debian, allowed, log) if peer.debian else ""
    measure.need(peer.build[0])
    logged([part.format(here=HERE, out=peer.program) for part in peer.build], log, "it does not compile")
    compiler = measure.output_of([peer.build[0], "-dumpfullversion"]).strip()
    return ", ".join(filter(None, [version, f"{peer.build[0]} {compiler}"]))


# ---- Measurement ----------------------------------------------------------------------------------------------------------


def command_of(peer, flights, repetitions):
    where = [WORK / "work.txt", PARTICLES, flights, repetitions]
    if peer.python:
        return [WORK / "venv/bin/python", "-B", HERE / "python_peers.py", peer.python, *where]
    return [peer.program, *where]


def run_once(peer):
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    return measure.pairs_of(command_of(peer, FLIGHTS, 5 if peer.native else 1), env={**os.environ, **threads})


def count(peer):
    _, profile = measure.callgrind(list(map(str, command_of(peer, 1, 1))), ["peer_cycle"])
    steps = 100
    return profile.total() / (PARTICLES * steps)


def figures(options):
    WORK.mkdir(parents=True, exist_ok=True)
    logged([*C, HERE / "record.c", "-o", WORK / "record", "-lm"], WORK / "record.log", "the recorder does not compile")
    (WORK / "work.txt").write_text(measure.output_of([WORK / "record", FLIGHTS]))
    rows = {}
    for peer in PEERS:
        row = rows[peer.name] = {"language": peer.language, "library": peer.library, "note": peer.note, "missing": None}
        try:
            row["version"] = prepare(peer, not options.no_install)
        except Failure as failure:
            row["missing"] = str(failure)
    there = [peer for peer in PEERS if rows[peer.name]["missing"] is None]
    for _ in range(ROUNDS):
        for peer in there:
            said, row = run_once(peer), rows[peer.name]
            row["ns"] = min(float(said["ns"]), row.get("ns", float("inf")))
            row["rmse"], row["resampled"] = float(said["rmse"]), float(said["resampled"])
    for peer in there:
        row = rows[peer.name]
        row["instructions"] = round(count(peer), 1) if peer.native else None
        row["same_work"] = abs(row["rmse"] / rows["pflight"]["rmse"] - 1.0) <= WITHIN
    return {"schema": 1, "benchmark": "peers", "particles": PARTICLES, "flights": FLIGHTS, "instructions_not_cycles": True,
            "rounds": ROUNDS, "within": WITHIN, "peers": rows, "ratios": ratios(rows)}


def ratios(rows):
    """How many times our instructions the best of the others takes, of libraries and of all."""
    counts = {name: row for name, row in rows.items() if name != "pflight" and row.get("instructions") and row["same_work"]}
    best = {}
    for what, wanted in (("library", lambda row: row["library"]), ("any", lambda row: True)):
        some = {name: row["instructions"] for name, row in counts.items() if wanted(row)}
        if some:
            name = min(some, key=some.get)
            best[what] = {"name": name, "ratio": round(some[name] / rows["pflight"]["instructions"], 2)}
    return best


# ---- Output ---------------------------------------------------------------------------------------------------------------


def cells(name, row):
    if row["missing"]:
        return [name, "-", "-", "-", "-", f"not measured: {row['missing']}"]
    instructions = "-" if row["instructions"] is None else f"{row['instructions']:.1f}"
    mark = "" if row["same_work"] else "NOT THE SAME WORK: "
    return [name, instructions, f"{row['ns']:.1f}", f"{row['rmse']:.3f}", f"{100 * row['resampled']:.0f} %",
            f"{mark}{row['note']}; {row['version']}"]


def summary(result):
    words = {"library": "the best library", "any": "the best of all, our textbook programs included"}
    return [f"{words[what]}: {best['name']}, {best['ratio']:.2f} times our instructions" for what, best in result["ratios"].items()]


def table(result):
    head = ["filter", "instructions", "ns", "RMSE [m]", "resampling", "what, and of which version"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(cells(name, row)) + " |" for name, row in result["peers"].items()]
    lines += ["", ". ".join(line[0].upper() + line[1:] for line in summary(result)) + ". " + LEFT_OUT, "",
              "`tools/bench peers` installed, built, ran and counted these: `gcc -std=gnu99 -O3 -march=x86-64-v3`, "
              "`g++ -std=c++17 -O3 -march=x86-64-v3`, `RUSTFLAGS=\"-C target-cpu=x86-64-v3\" cargo build --release` with LTO, "
              f"`pip install -r tools/benchmark/peers/requirements.txt`; then `PROGRAM work.txt {PARTICLES} {FLIGHTS} 5` in "
              f"{ROUNDS} rounds, and `valgrind --tool=callgrind --toggle-collect=peer_cycle PROGRAM work.txt {PARTICLES} 1 1`. "
              "Python is timed only. Debian's libraries are compiled for plain x86-64, as Debian ships them. Per particle and "
              "step; times of a shared virtual machine, within some 20 %."]
    return "\n".join(lines)


def show(result):
    print(f"per particle and step, N = {result['particles']}; instructions, not cycles\n")
    print(f"{'filter':<20s}{'instructions':>13s}{'ns':>9s}{'RMSE [m]':>10s}{'resampling':>12s}")
    for name, row in result["peers"].items():
        a, b, c, d, e, f = cells(name, row)
        print(f"{a:<20s}{b:>13s}{c:>9s}{d:>10s}{e:>12s}  {f}")
    print("\n" + "\n".join(summary(result)) + "\n" + LEFT_OUT)


def run(options):
    result = figures(options)
    measure.deliver(result, options, show)
    return 0 if all(row["missing"] or row["same_work"] for row in result["peers"].values()) else 1
