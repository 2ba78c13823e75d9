"""Tests of tools/tune on a log made up with truth. Run by test/checks/tune."""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import encode  # noqa: E402

TUNE = encode.ROOT / "tools/tune"


class Tune(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="pflight-tune-"))
        cls.log = cls.folder / "log"
        cls.log.mkdir()
        tables = encode.made_up(300)
        for name, table in (("gps.csv", tables["gps.csv"]), ("truth.csv", tables["nav.csv"])):
            rows = zip(table["t_s"], table["north_m"], table["east_m"])
            (cls.log / name).write_text("t_s,north_m,east_m\n" + "".join(f"{t:.3f},{n:.5f},{e:.5f}\n" for t, n, e in rows))
        cls.whole = cls.tune("whole", "--set", "motion=1:4", "--set", "sigma_gps=1")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    @classmethod
    def tune(cls, out, *more, target="none", particles="50:200:800"):
        return subprocess.run([str(TUNE), "replay", "--data", str(cls.log), "--particles", particles, "--runs", "2", "--target",
                               target, "--out", str(cls.folder / out), *more], capture_output=True, text=True, check=False,
                              stdin=subprocess.DEVNULL)

    def proposal(self, out):
        return json.loads((self.folder / out / "proposal.json").read_text())

    def test_the_proposal_is_the_cheapest_within_the_slack(self):
        self.assertEqual(self.whole.returncode, 0, self.whole.stderr)
        points = [json.loads(line) for line in (self.folder / "whole/points.jsonl").read_text().splitlines()]
        self.assertEqual(len(points), 6)

        def error(point):
            return point["result"]["metrics"]["innovation_m"]["mean"]

        many = [point for point in points if point["result"]["settings"]["particles"] == 800]
        best = min(many, key=error)
        same = [point["result"]["settings"]["particles"] for point in points
                if point["result"]["settings"]["motion"] == best["result"]["settings"]["motion"] and
                error(point) <= 1.03 * error(best)]
        proposal = self.proposal("whole")
        self.assertEqual(proposal["particles"], min(same))
        self.assertEqual(float(proposal["set"]["motion"]), float(best["result"]["settings"]["motion"]))
        self.assertIn(f"proposed: N={min(same)} ", self.whole.stdout)

    def test_a_stopped_sweep_goes_on_and_comes_to_the_same(self):
        stopped = self.folder / "stopped"
        stopped.mkdir()
        lines = (self.folder / "whole/points.jsonl").read_text().splitlines(keepends=True)
        (stopped / "points.jsonl").write_text("".join(lines[:3]) + lines[3][:40])  # in the midst of a write
        again = self.tune("stopped", "--set", "motion=1:4", "--set", "sigma_gps=1")
        self.assertIn("6 of 6 points (3 kept from before)", again.stderr)

        def metrics(name):
            return [json.loads(line)["result"][key] for line in (self.folder / name / "points.jsonl").read_text().splitlines()
                    if line.endswith("}") and line.startswith("{\"line\"") for key in ("metrics", "hash")]

        self.assertEqual(metrics("stopped"), metrics("whole"))
        third = self.tune("stopped", "--set", "motion=1:4", "--set", "sigma_gps=1")
        self.assertIn("6 of 6 points (6 kept from before)", third.stderr)

    def test_the_figure_is_drawn_or_its_lack_is_said(self):
        path = self.folder / "whole/tune.svg"
        if "no figure" in self.whole.stdout:
            self.skipTest("no matplotlib")
        self.assertIn("<svg", path.read_text())

    def test_the_consistency_is_judged(self):
        for sigma, words in (("0.2", "too sure"), ("5", "too modest")):
            done = self.tune("nis" + sigma, "--set", f"sigma_gps={sigma}", "--set", "motion=4", particles="400")
            self.assertIn(words, done.stdout, done.stderr)
        metrics = self.proposal("nis5")["result"]["metrics"]
        self.assertLess(metrics["nees"]["mean"], 2.0)
        self.assertLess(metrics["error_m"]["mean"], 2.0)

    def test_cost_on_the_target(self):
        if shutil.which("arm-none-eabi-gcc") is None or shutil.which("qemu-system-arm") is None:
            self.skipTest("no Cortex-M4F: tools/setup target")
        done = self.tune("m4", "--set", "motion=4", target="cortex-m4f", particles="50:100")
        self.assertEqual(done.returncode, 0, done.stderr)
        there = self.proposal("m4")["on_target"]
        self.assertIn(f"RAM {there['arena_bytes']} B", done.stdout)
        self.assertTrue(there["same_bits"])
        self.assertGreater(there["stack_bytes"]["pfl_predict"], 0)
        # The C below is of the same filter, and says its size on a machine with its own size of pointers: no smaller.
        self.assertLessEqual(there["arena_bytes"], int(re.search(r"/\* (\d+) B \*/", done.stdout).group(1)))

    def test_any_scenario(self):
        done = subprocess.run([str(TUNE), "land-vehicle", "--particles", "50:100", "--runs", "5", "--target", "none", "--out",
                               str(self.folder / "land")], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("proposed: N=", done.stdout)

    def test_wrong_lines_are_answered_in_one(self):
        for arguments, status, words in [([], 2, "scenario"), (["replay", "--set", "motion"], 2, "KEY=VALUE"),
                                         (["replay", "--particles", "0"], 2, "from 1"),
                                         (["replay", "--particles", "many"], 2, "many"),
                                         (["boat", "--out", str(self.folder / "x")], 2, "unknown scenario"),
                                         (["land-vehicle", "--metric", "beauty", "--particles", "10", "--runs", "1", "--out",
                                           str(self.folder / "x")], 2, "the metrics are")]:
            done = subprocess.run([str(TUNE), *arguments], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stdout), (status, ""), f"{arguments}: {done.stderr}")
            self.assertIn(words, done.stderr.splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
