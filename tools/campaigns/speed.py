"""One worker against two on the same shards, from the first one's begin to the last one's end: without the start of Python
or of a cluster. Where others use the processors too, that tells little; how many shards are in flight at once still does."""
import engines
import sweep

JOBS, SEEDS, TIMES, LINE = 16, 2, 8, ["land-vehicle", "--particles", "3000", "--runs", "20"]


def measured(engine, jobs, workers):
    """Seconds, and how many shards were in flight on average."""
    done = list(engine(jobs, workers))
    seconds = max(one["end_s"] for one in done) - min(one["begin_s"] for one in done)
    return seconds, sum(one["end_s"] - one["begin_s"] for one in done) / seconds


def compare(program):
    common = {"campaign": "speed", "program": str(program), "digest": sweep.digest(program.read_bytes()), "line": LINE}
    jobs = [{**common, "shard": k, "seeds": range(k * SEEDS + 1, (k + 1) * SEEDS + 1)} for k in range(JOBS)]
    lines = [f"{JOBS} shards of {SEEDS} seeds, tools/run {' '.join(LINE)}; the fastest of {TIMES} times"]
    for name, engine in (("processes", engines.on_processes), ("dask", engines.on_dask)):
        pairs = [(measured(engine, jobs, 1), measured(engine, jobs, 2)) for _ in range(TIMES)]
        (one, _), (two, flying) = map(min, zip(*pairs))
        lines.append(f"{name}: 1 worker {one:.2f} s, 2 workers {two:.2f} s: {one / two:.2f} times as fast, with {flying:.2f} "
                     "shards in flight on average")
    return "\n".join(lines)
