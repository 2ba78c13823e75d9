"""What a campaign is to fly, and the folder that keeps what has been flown.

    DIR/plan.json         the plan, and by its digest the program
    DIR/program           a copy of the runner: a build in the meantime changes nothing
    DIR/shards/K.json     a finished shard, whole or not there
    DIR/log.jsonl         who flew it, from when to when: for people, no part of the result
    DIR/result.json       all of it merged
"""
import itertools
import json
import pathlib
import shutil

import sweep
from sweep import Failure


def points_of(fixed, grid):
    """Every combination of the grid's values (A,B or, where values have commas themselves, A:B), with the fixed ones."""
    values = {}
    for entry, varied in [(entry, False) for entry in fixed] + [(entry, True) for entry in grid]:
        key, _, text = entry.partition("=")
        several = text.split(":" if ":" in text else ",") if varied else [text]
        if not key or "" in several or key in values or len(set(several)) < len(several):
            raise Failure(f"{entry}: give KEY=VALUE, after --grid KEY=VALUE,VALUE; each key and each value once", 2)
        values[key] = several
    return [dict(zip(values, chosen)) for chosen in itertools.product(*values.values())]


def digest_of_folder(path):
    files = sorted(file for file in pathlib.Path(path).rglob("*") if file.is_file())
    return sweep.digest("".join(f"{file.relative_to(path)} {sweep.digest(file.read_bytes())}\n" for file in files).encode())


def line_of(plan, point):
    """The runner's arguments, but for the seed."""
    line = [plan["scenario"], "--runs", str(plan["runs"])] + (["--data", plan["data"]] if plan["data"] else [])
    for key, value in point.items():
        line += [f"--{key}", value] if key in ("filter", "particles") else ["--set", f"{key}={value}"]
    return line


def refuse_error(done):
    if "error" in done:
        raise Failure(done["error"], done["status"])


class Folder:
    def __init__(self, path):
        self.path = pathlib.Path(path).resolve()
        file = self.path / "plan.json"
        self.plan = json.loads(file.read_text()) if file.exists() else None

    def begin(self, plan, program, anew):
        """Takes up what is there of this plan, or begins it: true then."""
        if self.plan == plan and not anew:
            return False
        if self.plan is not None and not anew and any(self.path.glob("shards/*.json")):
            differ = ", ".join(key for key in plan if plan[key] != self.plan.get(key))
            raise Failure(f"{self.path} holds shards of another campaign (another {differ}): --anew throws them away, "
                          "--out DIR takes another folder", 2)
        self.forget()
        (self.path / "slurm").mkdir(parents=True)
        shutil.copy(program, self.path / "program")
        sweep.write_whole(self.path / "plan.json", json.dumps(plan, indent=1) + "\n")
        self.plan = plan
        return True

    def forget(self):
        for name in ("plan.json", "program", "log.jsonl", "result.json"):
            (self.path / name).unlink(missing_ok=True)
        for name in ("shards", "slurm"):
            shutil.rmtree(self.path / name, ignore_errors=True)

    def stamp(self):
        return sweep.digest(json.dumps(self.plan).encode())

    def load(self, k):
        """A shard's rows and libm; none where it is missing, spoilt, or of another plan."""
        try:
            stored = json.loads((self.path / f"shards/{k}.json").read_text())
            return (stored["rows"], stored["libm"]) if stored["plan"] == self.stamp() else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def keep(self, done):
        refuse_error(done)
        shard = json.dumps({"plan": self.stamp(), "libm": done.pop("libm"), "rows": done.pop("rows")})
        sweep.write_whole(self.path / f"shards/{done['shard']}.json", shard + "\n")
        with open(self.path / "log.jsonl", "a") as log:
            log.write(json.dumps(done) + "\n")

    def jobs(self):
        """All shards, each with what a worker must know of it. All points come before the second shard of any: a wrong
        setting is soon found."""
        seeds, size = range(self.plan["seeds"][0], self.plan["seeds"][1] + 1), self.plan["shard"]
        chunks = [list(seeds[start:start + size]) for start in range(0, len(seeds), size)]
        return [{"campaign": self.stamp(), "shard": k, "program": str(self.path / "program"), "digest": self.plan["program"],
                 "line": line_of(self.plan, point), "seeds": chunk}
                for k, (chunk, point) in enumerate(itertools.product(chunks, self.plan["points"]))]
