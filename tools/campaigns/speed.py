"""One worker against two on the same shards, from the first one's begin to the last one's end: without the start of Python
or of a cluster. Where others use the machine too, the best of some times is the least wrong."""
import engines
import sweep

JOBS, SEEDS, LINE = 16, 4, ["land-vehicle", "--particles", "3000", "--runs", "20"]


def seconds(engine, jobs, workers):
    done = list(engine(jobs, workers))
    return max(one["end_s"] for one in done) - min(one["begin_s"] for one in done)


def compare(program, times):
    common = {"campaign": "speed", "program": str(program), "digest": sweep.digest(program.read_bytes()), "line": LINE}
    jobs = [{**common, "shard": k, "seeds": range(k * SEEDS + 1, (k + 1) * SEEDS + 1)} for k in range(JOBS)]
    lines = [f"{JOBS} shards of {SEEDS} seeds, tools/run {' '.join(LINE)}; the best of {times}"]
    for name, engine in (("processes", engines.on_processes), ("dask", engines.on_dask)):
        both = [(seconds(engine, jobs, 1), seconds(engine, jobs, 2)) for _ in range(times)]
        one, two = map(min, zip(*both))
        lines.append(f"{name}: 1 worker {one:.2f} s, 2 workers {two:.2f} s: {one / two:.2f} times as fast")
    return "\n".join(lines)
