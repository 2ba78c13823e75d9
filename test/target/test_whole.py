"""tools/target bits notices a line that is not golden; the cycles of a whole run are those with an update, each with what
belongs to it, by filter."""
import contextlib
import io
import pathlib
import subprocess
import sys
import tempfile
import types

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "tools/targets"))
import flight  # noqa: E402
import golden  # noqa: E402
import whole  # noqa: E402

# ---- Golden hashes: what a machine prints is made up -------------------------------------------------------------------------


def verdict(printed, status=0):
    said, run = io.StringIO(), subprocess.run
    golden.built = lambda machine: pathlib.Path("image")
    subprocess.run = lambda *_, **__: types.SimpleNamespace(returncode=status, stdout=printed, stderr="")
    try:
        with contextlib.redirect_stdout(said):
            return golden.compare("cortex-m4f"), said.getvalue()
    finally:
        subprocess.run = run


lines = golden.GOLDEN.read_text()
assert verdict(lines)[0]
name, old = lines.splitlines()[-1].split()
good, said = verdict(lines.replace(old, old[:-1] + ("0" if old[-1] != "0" else "1")))
assert not good and name in said and "NOT" in said, said
assert not verdict(lines[:lines.rindex("\n", 0, -1) + 1])[0], "a missing line"
try:
    verdict("FAULT: bus\n", 103)
    raise AssertionError("a fault is no verdict")
except flight.Failure as failure:
    assert "103" in str(failure)

# ---- Cycles out of the plugin's log -----------------------------------------------------------------------------------------


def cycles(*calls):
    with tempfile.TemporaryDirectory() as folder:
        log = pathlib.Path(folder) / "calls.txt"
        log.write_text("".join(f"call=pfl_{call} instructions={count} normalise={part} resample={resample}\n"
                               for call, count, part, resample in calls))
        return whole.read_cycles(log)


INIT, PREDICT, UPDATE, ESTIMATE = ("init", 999, 0, 0), ("predict", 100, 0, 0), ("update", 60, 10, 20), ("estimate", 7, 0, 0)
LOOK, FORK, TEMPERED = ("auxiliary_look", 50, 5, 0), ("fork", 40, 0, 0), ("tempered_update", 300, 30, 90)
one, two = cycles(INIT, PREDICT, UPDATE, ESTIMATE, PREDICT, ESTIMATE, INIT, LOOK, PREDICT, TEMPERED)
assert [cycle["updates"] for cycle in one] == [1, 0] and [cycle["updates"] for cycle in two] == [1]
assert one[0]["stages"] | {} == dict.fromkeys(flight.STAGES, 0) | {
    "predict": 100, "update": 30, "normalise": 10, "resample": 20, "estimate": 7}, one[0]
assert sum(two[0]["stages"].values()) == 450 and two[0]["resamples"] and not one[1]["resamples"]
(ahead,) = cycles(INIT, PREDICT, UPDATE, FORK, PREDICT, PREDICT, PREDICT, UPDATE)
assert [cycle["updates"] for cycle in ahead] == [1, 0, 0, 0, 1] and sum(ahead[0]["stages"].values()) == 160
assert whole.chosen("terrain", [ahead], None) == ([ahead[0], ahead[4]], 0)
assert whole.chosen("road-network", [[], [], [], ahead], "two") == ([ahead[0], ahead[4]], 3)
for scenario, wanted, words in (("terrain", "x", "one filter"), ("sharp", "x", "adapted")):
    try:
        whole.name_of_filter(scenario, wanted)
        raise AssertionError(scenario)
    except flight.Failure as failure:
        assert words in str(failure) and failure.status == 2
assert whole.name_of_filter("sharp", None) == "adapted" and whole.name_of_filter("wind", None) is None
print("tools/target notices what it should")
