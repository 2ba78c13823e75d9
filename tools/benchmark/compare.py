"""Two results of tools/bench, as --json wrote them: what changed, and exit 1 where the second is worse.

Worse means more instructions or bytes than the tolerance allows, or, where both flew the same work, another hash. Times
are shown and not judged, except with --time, which gives them a tolerance of their own."""
import argparse
import json
import pathlib

from measure import Failure

JUDGED = ("instruction", "bytes", "stages", "resample_never", "resample_always", "resampling_over_plain", "cycle_m")
UNJUDGED = ("particles", "steps", "rounds", "repetitions", "elements", "schema", "rmse", "within", "ratio", "resampled",
            "resampling_share", "wanted")


def percent(text):
    try:
        value = float(text.rstrip("%"))
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= 1000.0:
        raise argparse.ArgumentTypeError(f"a percentage from 0 to 1000 is wanted, not '{text}'")
    return value


def add_options(parser):
    parser.add_argument("before", metavar="A.json")
    parser.add_argument("after", metavar="B.json")
    parser.add_argument("--tolerance", type=percent, default=2.0, metavar="PERCENT", help="of instructions and bytes (default: 2)")
    parser.add_argument("--time", type=percent, metavar="PERCENT", help="judge the times too, by this tolerance")
    parser.add_argument("--any-bits", action="store_true", help="a change of a hash is no failure")


def load(path):
    try:
        result = json.loads(pathlib.Path(path).read_text())
    except (OSError, ValueError) as error:
        raise Failure(f"{path}: {error}", 2) from error
    if not isinstance(result, dict) or "benchmark" not in result:
        raise Failure(f"{path} is not what tools/bench --json writes", 2)
    return result


def leaves(value, path=""):
    """The numbers and hashes of a result by their dotted names."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield path, value
    elif isinstance(value, str) and path.split(".")[-1] == "hash":
        yield path, value


def is_time(name):
    return name.split(".")[-1].startswith("ns")


def is_judged(name):
    last = name.split(".")[-1]
    return any(word in name for word in JUDGED) and not any(last.startswith(word) for word in UNJUDGED)


def compare(before, after, options):
    """Lines to print, and whether one of them is worse."""
    lines, worse = [], False
    old, new = dict(leaves(before)), dict(leaves(after))
    for name in old.keys() | new.keys():
        if name not in old or name not in new:
            lines.append((name, old.get(name, "-"), new.get(name, "-"), "", "only in one"))
    for name in [name for name in old if name in new]:
        a, b = old[name], new[name]
        if isinstance(a, str) or isinstance(b, str):
            if a != b:
                worse = worse or not options.any_bits
                lines.append((name, a, b, "", "other bits" if options.any_bits else "WORSE: other bits"))
            continue
        tolerance = options.time if is_time(name) else options.tolerance if is_judged(name) else None
        change = 0.0 if a == b else (100.0 * (b - a) / a if a else float("inf"))
        # A stage of a fraction of an instruction may double without anybody's loss.
        bad = tolerance is not None and change > tolerance and b - a > 0.05
        worse = worse or bad
        if abs(change) > 0.05:
            lines.append((name, a, b, f"{change:+.1f} %", "WORSE" if bad else "" if tolerance is None else "better" if b < a else "within"))
    return sorted(lines), worse


def run(options):
    before, after = load(options.before), load(options.after)
    for key in ("benchmark", "scenario", "build", "target"):
        if before.get(key) != after.get(key):
            raise Failure(f"not comparable: {key} is {before.get(key)} in {options.before}, {after.get(key)} in {options.after}", 2)
    lines, worse = compare(before, after, options)
    for name, a, b, change, verdict in lines:
        print(f"{name:<48s}{str(a):>18s}{str(b):>18s}{change:>10s}  {verdict}")
    print(f"{'WORSE' if worse else 'not worse'}: tolerance {options.tolerance:g} % on instructions and bytes" +
          ("" if options.time is None else f", {options.time:g} % on times"))
    return 1 if worse else 0
