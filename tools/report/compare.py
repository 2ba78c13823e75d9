#!/usr/bin/env python3
"""Compares two results of tools/run, metric by metric: is the difference more than chance?

A and B are objects of --json or files summary.json. A metric agrees when the two values are at most three combined
standard errors apart. A study agrees when its hash is the same, or else when every metric of it agrees. Metrics
without a standard error (the worst of some runs, say) are shown, but decide only when a study has no other.
"""
import json
import math
import pathlib
import sys

USAGE = "usage: tools/run compare A.json B.json (objects of --json, or summary.json of all scenarios)"
EXIT_AGREE, EXIT_DIFFER, EXIT_USAGE, EXIT_UNREADABLE = 0, 1, 2, 3
LIMIT = 3.0  # combined standard errors
ROUNDING = 1e-12  # relative; two exact filters differ by it, and so do their standard errors


class Unreadable(Exception):
    """A file that cannot be compared; the text is one line for a person."""


def refuse_constant(name):
    raise ValueError(f"{name} is no JSON")


def checked_study(study):
    """The study, if it has the shape that the comparison relies on."""
    if not isinstance(study, dict) or study.get("schema") != 1:
        raise ValueError("no object with schema 1")
    if not isinstance(study.get("metrics"), dict) or not isinstance(study.get("settings"), dict):
        raise ValueError("an object without metrics and settings")
    for name, metric in study["metrics"].items():
        if not isinstance(metric, dict) or not is_number(metric.get("mean")):
            raise ValueError(f"the metric {name} has no mean")
        if metric.get("stderr") is not None and not is_number(metric["stderr"]):
            raise ValueError(f"the standard error of {name} is no number")
    if not isinstance(study.get("scenario"), str) or not isinstance(study.get("hash"), str):
        raise ValueError("an object without scenario and hash")
    return study


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def load(path):
    """The studies of a file, and whether it is a summary."""
    try:
        data = json.loads(pathlib.Path(path).read_text(encoding="utf-8"), parse_constant=refuse_constant)
        if isinstance(data, dict) and isinstance(data.get("studies"), list):
            if data.get("schema") != 1:
                raise ValueError("a summary of another schema than 1")
            return [checked_study(study) for study in data["studies"]], True
        return [checked_study(data)], False
    except OSError as error:
        raise Unreadable(f"cannot read '{path}': {error.strerror}") from error
    except json.JSONDecodeError as error:
        raise Unreadable(f"'{path}', line {error.lineno}, column {error.colno}: no JSON: {error.msg}") from error
    except (ValueError, RecursionError) as error:
        raise Unreadable(f"'{path}' is no result of tools/run: {error}") from error


def key_of(study):
    """What makes two studies of two summaries the same: all but seed and runs."""
    settings = {name: value for name, value in study["settings"].items() if name not in ("seed", "runs")}
    return json.dumps([study["scenario"], settings], sort_keys=True)


def title_of(study):
    settings = " ".join(f"{name}={value}" for name, value in study["settings"].items())
    return f"{study['scenario']}: {settings}"


def pairs_of(a, b):
    """Pairs of studies; None where one side has none. Two single objects are a pair, whatever their settings."""
    (studies_a, summary_a), (studies_b, summary_b) = a, b
    if not summary_a and not summary_b:
        return [(studies_a[0], studies_b[0])]
    left = {key_of(study): study for study in studies_a}
    right = {key_of(study): study for study in studies_b}
    if summary_a != summary_b:  # a single result against the study of a summary that is like it
        keys = left if not summary_a else right
    else:
        keys = list(left) + [key for key in right if key not in left]
    return [(left.get(key), right.get(key)) for key in keys]


def combined_error(a, b):
    """Of the difference of two independent figures; None when neither has a standard error."""
    errors = [metric["stderr"] for metric in (a, b) if metric.get("stderr") is not None]
    return math.hypot(*errors) if errors else None


def judge(a, b):
    """Delta, its size in combined standard errors (None: there are none), and whether the two agree."""
    delta = b["mean"] - a["mean"]
    error = combined_error(a, b)
    if abs(delta) <= ROUNDING * max(abs(a["mean"]), abs(b["mean"])):
        return delta, 0.0, True
    if error is None:
        return delta, None, False
    size = abs(delta) / error if error > 0.0 else math.inf
    return delta, size, size <= LIMIT


def row(name, a, b, delta, size, verdict):
    width = "-" if size is None else f"{size:.2f}"
    return f"  {name:<24} {a['mean']:>14.6g} {b['mean']:>14.6g} {delta:>+14.6g} {width:>10}  {verdict}"


def compare_metrics(a, b):
    """Prints the metrics of a pair; answers whether they agree."""
    same_bits = a["hash"] == b["hash"]
    print(f"  {'metric':<24} {'A':>14} {'B':>14} {'B - A':>14} {'in errors':>10}  beyond {LIMIT:g}")
    judged = []
    unjudged = []
    for name in [*a["metrics"], *(name for name in b["metrics"] if name not in a["metrics"])]:
        if name not in a["metrics"] or name not in b["metrics"]:
            print(f"  {name:<24} only in {'A' if name in a['metrics'] else 'B'}")
            judged.append(False)
            continue
        pair = a["metrics"][name], b["metrics"][name]
        delta, size, agrees = judge(*pair)
        (unjudged if size is None else judged).append(agrees)
        print(row(name, *pair, delta, size, "-" if size is None else "no" if agrees else "YES"))
    print(f"  hash {a['hash']} and {b['hash']}: {'the same bits' if same_bits else 'other bits'}")
    return same_bits or all(judged if judged else unjudged)


def compare_pair(a, b):
    """Prints a pair of studies; answers whether they agree."""
    if a is None or b is None:
        print(f"{title_of(a or b)}\n  only in {'A' if b is None else 'B'}\n")
        return False
    print(title_of(a))
    others = title_of(b)
    if others != title_of(a):
        print(f"{others} (B)")
    agrees = compare_metrics(a, b)
    print(f"  {'agree' if agrees else 'DIFFER'}\n")
    return agrees


def main(arguments):
    if arguments in (["--help"], ["-h"]):
        print(USAGE, __doc__.partition("\n")[2].strip(), sep="\n\n")
        return EXIT_AGREE
    if len(arguments) != 2 or any(argument.startswith("-") for argument in arguments):
        print(USAGE, file=sys.stderr)
        return EXIT_USAGE
    try:
        pairs = pairs_of(load(arguments[0]), load(arguments[1]))
    except Unreadable as error:
        print(f"compare: {error}", file=sys.stderr)
        return EXIT_UNREADABLE
    agreed = [compare_pair(a, b) for a, b in pairs]
    print(f"{sum(agreed)} of {len(agreed)} studies agree")
    return EXIT_AGREE if all(agreed) else EXIT_DIFFER


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except BrokenPipeError:  # the reader went away: `... | head`
        sys.stderr.close()
        sys.exit(EXIT_DIFFER)
