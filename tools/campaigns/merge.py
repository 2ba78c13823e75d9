"""Shards into one result: the same bytes whoever flew them, in whatever order. At a point each figure has one value a seed,
the mean of that seed's runs; median and 95 % quantile (linear between neighbours) are over the seeds."""
import math
import statistics

import sweep


def figure_of(values):
    known, n = [value for value in values if value is not None], sum(value is not None for value in values)
    mean = math.fsum(known) / n
    return {"median": statistics.median(known), "mean": mean,
            "stderr": math.sqrt(math.fsum((value - mean) ** 2 for value in known) / (n - 1) / n) if n > 1 else None,
            "p95": statistics.quantiles(known, n=20, method="inclusive")[-1] if n > 1 else mean, "values": values}


def point_of(settings, rows, runs):
    names = dict.fromkeys(name for row in rows for name in row["figures"])
    return {"settings": settings, "runs": runs * len(rows), "hash": sweep.digest("".join(row["hash"] for row in rows).encode()),
            "figures": {name: figure_of([row["figures"].get(name) for row in rows]) for name in names}}


def result_of(plan, shards):
    """shards: rows and libm of each, in their order."""
    rows = [[row for rows, _ in shards[i::len(plan["points"])] for row in rows] for i in range(len(plan["points"]))]
    points = [point_of(settings, of_point, plan["runs"]) for settings, of_point in zip(plan["points"], rows)]
    return {"schema": 1, **{key: plan[key] for key in ("scenario", "program", "data_digest", "seeds")},
            "runs_of_a_seed": plan["runs"], "libm": sorted({libm for _, libm in shards}), "points": points}


def table(result):
    points = result["points"]
    told = [key for key in points[0]["settings"] if len({point["settings"][key] for point in points}) > 1]
    labels = [" ".join(f"{key}={point['settings'][key]}" for key in told) or "as set" for point in points]
    wide = max(len("settings"), *map(len, labels))
    long = max(len(name) for point in points for name in point["figures"])
    lines = [f"{'settings':<{wide}s} {'runs':>7s}  {'figure':<{long}s} {'median':>10s} {'mean':>10s} {'+-':>8s} {'p95':>10s}"]
    for label, point in zip(labels, points):
        left = f"{label:<{wide}s} {point['runs']:>7d}"
        for name, figure in point["figures"].items():
            error = "" if figure["stderr"] is None else f"{figure['stderr']:.2g}"
            lines.append(f"{left}  {name:<{long}s} {figure['median']:>10.4g} {figure['mean']:>10.4g} {error:>8s} "
                         f"{figure['p95']:>10.4g}")
            left = " " * len(left)
    return "\n".join(lines)
