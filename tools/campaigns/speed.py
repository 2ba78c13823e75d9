"""One worker against two, on the same shards: from the first shard's begin to the last one's end, so without the start of
Python or of a cluster. On a machine that others use too, the best of some times is the least wrong."""
import engines
import sweep

JOBS, SEEDS = 16, 4
LINE = ["land-vehicle", "--particles", "3000", "--runs", "20"]


def seconds(engine, jobs, workers):
    done = list(engine(jobs, workers))
    for one in done:
        if "error" in one:
            raise sweep.Failure(one["error"], one["status"])
    return max(one["end_s"] for one in done) - min(one["begin_s"] for one in done)


def compare(program, times):
    common = {"campaign": "speed", "program": str(program), "digest": sweep.digest(program.read_bytes()), "line": LINE}
    jobs = [{**common, "shard": k, "seeds": range(k * SEEDS + 1, (k + 1) * SEEDS + 1)} for k in range(JOBS)]
    lines = [f"{JOBS} shards of {SEEDS} seeds, tools/run {' '.join(LINE)}; the best of {times}"]
    for name, engine in (("processes", engines.on_processes), ("dask", engines.on_dask)):
        best = {1: float("inf"), 2: float("inf")}
        for _ in range(times):
            for workers in best:
                best[workers] = min(best[workers], seconds(engine, jobs, workers))
        lines.append(f"{name}: 1 worker {best[1]:.2f} s, 2 workers {best[2]:.2f} s: {best[1] / best[2]:.2f} times as fast")
    return "\n".join(lines)
