"""Tests of tools/log, and of one replay on host, in Python and on an emulated Cortex-M4F. Run by test/checks/logs."""
import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import encode  # noqa: E402

ROOT = encode.ROOT
WRITERS = {"flight.ulg": encode.write_ulog, "flight.bin": encode.write_dataflash, "flight.tlog": encode.write_telemetry,
           "flight.csv": encode.write_table}


def tool(name, *arguments, environment=None):
    return subprocess.run([str(ROOT / "tools" / name), *map(str, arguments)], capture_output=True, text=True, check=False,
                          stdin=subprocess.DEVNULL, env={**os.environ, **(environment or {})})


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return {c: np.array([float(row[c] or "nan") for row in rows]) for c in rows[0]}


class Import(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.tables, source = encode.recorded()
        print(f"logs: {source}", file=sys.stderr)
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="pflight-logs-"))
        for name, write in WRITERS.items():
            write(cls.tables, cls.folder / name)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def take(self, name, *more):
        out = self.folder / ("out-" + name)
        done = tool("log", "import", self.folder / name, "--out", out, *more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return out, done.stdout

    def check_gps(self, out, velocity=True, tolerance=0.02):
        mine, theirs = read(out / "gps.csv"), self.tables["gps.csv"]
        self.assertEqual(len(mine["t_s"]), len(theirs["t_s"]))
        np.testing.assert_allclose(mine["t_s"], theirs["t_s"] - theirs["t_s"][0], atol=2e-6)
        np.testing.assert_allclose(mine["lat_deg"], theirs["lat_deg"], atol=6e-8)
        for column in ("north_m", "east_m"):  # 1e-7 degrees are 11 mm, and a made-up flight is on a rougher plane
            np.testing.assert_allclose(mine[column], theirs[column], atol=0.03 + 1e-3 * np.abs(theirs[column]).max())
        np.testing.assert_allclose(mine["alt_msl_m"], theirs["alt_msl_m"], atol=0.006)
        for column in ("vn_mps", "ve_mps") if velocity else ():
            np.testing.assert_allclose(mine[column], theirs[column], atol=tolerance)

    def test_ulog(self):
        out, said = self.take("flight.ulg")
        self.check_gps(out, tolerance=1e-5)
        gps, nav, modes, att = (read(out / f"{name}.csv") for name in ("gps", "nav", "modes", "att"))
        np.testing.assert_allclose(gps["vd_mps"], self.tables["gps.csv"]["vd_mps"], atol=1e-5)
        np.testing.assert_allclose(gps["eph_m"], self.tables["gps.csv"]["eph_m"], atol=1e-5)
        for column in ("north_m", "east_m", "alt_msl_m", "vn_mps"):
            np.testing.assert_allclose(nav[column], self.tables["nav.csv"][column], atol=1e-3)
        np.testing.assert_array_equal(modes["px4_nav_state"], [0, 3])
        course = np.arctan2(gps["ve_mps"], gps["vn_mps"])
        np.testing.assert_allclose(np.cos(att["yaw_rad"]), np.cos(course), atol=1e-4)
        self.assertIn("air.csv       not written: the log has no airspeed", said)

    def test_dataflash(self):
        out, said = self.take("flight.bin")
        self.check_gps(out, tolerance=1e-4)
        gps, baro, nav = (read(out / f"{name}.csv") for name in ("gps", "baro", "nav"))
        np.testing.assert_allclose(gps["vd_mps"], self.tables["gps.csv"]["vd_mps"], atol=1e-5)
        np.testing.assert_allclose(baro["baro_alt_m"], gps["alt_msl_m"] - gps["alt_msl_m"][0], atol=0.02)
        np.testing.assert_allclose(nav["vn_mps"], self.tables["nav.csv"]["vn_mps"], atol=0.2)
        np.testing.assert_array_equal(read(out / "modes.csv")["ardupilot_mode"], [10])
        self.assertIn("the log has no eph_m, epv_m", said)

    def test_telemetry(self):
        out, _ = self.take("flight.tlog")
        self.check_gps(out)
        self.assertNotIn("vd_mps", read(out / "gps.csv"))
        np.testing.assert_allclose(read(out / "air.csv")["ias_mps"], 17.0)
        np.testing.assert_allclose(read(out / "att.csv")["roll_rad"], 0.1, atol=1e-6)

    def test_table(self):
        out, _ = self.take("flight.csv", "--map", "vn_mps=speed_north_cms*0.01", "--map", "ve_mps=speed_east_cms*0.01")
        self.check_gps(out)

    def test_rate(self):
        out, _ = self.take("flight.ulg", "--rate", "1")
        self.assertLess(len(read(out / "gps.csv")["t_s"]), 0.3 * len(self.tables["gps.csv"]["t_s"]))
        self.assertGreater(np.diff(read(out / "gps.csv")["t_s"]).min(), 0.2)

    def test_wrong_lines_are_answered_in_one(self):
        flight = self.folder / "flight.csv"
        for arguments, status, words in [
                ([], 2, "import|columns"), (["import", flight], 2, "--out"),
                (["import", self.folder / "x.doc", "--out", "o"], 2, ".ulg, .bin, .log, .tlog, .csv"),
                (["import", self.folder / "no.ulg", "--out", "o"], 3, "no such file"),
                (["import", flight, "--out", "o", "--map", "up=altitude"], 2, "the columns are"),
                (["import", flight, "--out", "o", "--map", "vn_mps=speed"], 2, "its columns are: time_ms"),
                (["import", flight, "--out", "o", "--rate", "0"], 2, "above 0")]:
            done = tool("log", *arguments)
            self.assertEqual((done.returncode, done.stdout), (status, ""), arguments)
            self.assertIn(words, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)

    def test_damaged_logs_are_refused_or_read_as_far_as_they_go(self):
        for name in ("flight.ulg", "flight.bin", "flight.tlog"):
            whole = (self.folder / name).read_bytes()
            for label, damaged in [("cut", whole[:len(whole) // 3]), ("nothing", b""), ("noise", bytes(range(256)) * 20)]:
                path = self.folder / f"{label}-{name}"
                path.write_bytes(damaged)
                done = tool("log", "import", path, "--out", self.folder / "damaged")
                self.assertIn(done.returncode, (0, 3), f"{path}: {done.stderr}")
                self.assertNotIn("Traceback", done.stderr)
                self.assertFalse(label != "cut" and done.returncode == 0, f"{path}: {done.stdout}")

    def test_columns_are_named(self):
        done = tool("log", "columns")
        self.assertEqual(done.returncode, 0)
        self.assertIn("vehicle_gps_position", done.stdout)


class Replay(unittest.TestCase):
    """One log, flown by the runner in C, by the Python module, and by an emulated Cortex-M4F."""
    SETTINGS = {"motion": 6.0, "sigma_gps": 1.0}

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="pflight-replay-"))
        tables, _ = encode.recorded(rows=150)
        cls.log = cls.folder / "log"
        encode.write_dataflash(tables, cls.folder / "flight.bin")  # of all kinds the one with a barometer
        done = tool("log", "import", cls.folder / "flight.bin", "--out", cls.log)
        assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def host(self, *arguments):
        done = tool("run", "replay", "--data", self.log, "--runs", 1, "--threads", 1, "--json", "-", *arguments)
        self.assertIn(done.returncode, (0, 1), done.stderr)  # 1: a busy machine spent the time budget
        return json.loads(done.stdout)

    def same_bits_everywhere(self, model, sensors):
        import pflight
        host = self.host("--particles", 100, "--model", model, "--sensors", sensors, "--motion", 6, "--sigma_gps", 1)
        mine = pflight.replay.fly(self.log, particles=100, model=model, sensors=tuple(sensors.split(",")), **self.SETTINGS)
        self.assertEqual(f"{mine.hash:016x}", host["hash"])
        self.assertAlmostEqual(mine.mean_nis(), host["metrics"]["nis"]["mean"], places=9)
        if shutil.which("arm-none-eabi-gcc") is None or shutil.which("qemu-system-arm") is None:
            self.skipTest("no Cortex-M4F: tools/setup target")
        done = tool("target", "run", "replay", "--target", "cortex-m4f", "--particles", 100, "--set", f"model={model}",
                    "--set", f"sensors={sensors}", "--set", "motion=6", "--set", "sigma_gps=1", "--json", "-",
                    environment={"PFLIGHT_DATA": str(self.log)})
        self.assertEqual(done.returncode, 0, done.stderr)
        target = json.loads(done.stdout)
        self.assertTrue(target["same_bits"])
        self.assertEqual(target["hash"], host["hash"])
        print(f"logs: {model} on {sensors}: hash {host['hash']} on host, in Python and on the Cortex-M4F", file=sys.stderr)

    def test_host_python_and_cortex_m4f_compute_the_same_bits(self):
        self.same_bits_everywhere("cv", "gps,velocity")

    def test_and_with_height_and_a_biased_barometer(self):
        self.same_bits_everywhere("hover", "gps,velocity,height,baro")

    def test_every_model_in_c_and_python(self):
        import pflight
        for model, sensors in [("cv", "gps"), ("turn", "gps,velocity"), ("hover", "gps,height"), ("turn", "gps")]:
            host = self.host("--model", model, "--sensors", sensors, "--seed", 7, "--gate", 30)
            mine = pflight.replay.fly(self.log, model=model, sensors=tuple(sensors.split(",")), seed=7, gate=30.0)
            self.assertEqual(f"{mine.hash:016x}", host["hash"], f"{model} {sensors}")

    def test_odometry(self):
        """A folder by hand: a car that drives a circle, with odometry and fixes."""
        import pflight
        folder = self.folder / "car"
        folder.mkdir(exist_ok=True)
        random = np.random.default_rng(5)
        t = np.arange(0, 60, 0.5)
        north, east = 20 * np.sin(0.1 * t), 20 * (1 - np.cos(0.1 * t))
        rows = zip(t, north + random.normal(0, 2, t.size), east + random.normal(0, 2, t.size))
        (folder / "gnss_fix.csv").write_text("t_s,north_m,east_m\n" + "".join(f"{a:.3f},{b:.4f},{c:.4f}\n" for a, b, c in rows))
        (folder / "odometry.csv").write_text("t_s,v_forward_mps,yaw_rate_radps\n" + "".join(f"{a:.3f},2.0,-0.1\n" for a in t))
        (folder / "truth.csv").write_text("t_s,north_m,east_m\n" +
                                          "".join(f"{a:.3f},{b:.4f},{c:.4f}\n" for a, b, c in zip(t, north, east)))
        done = tool("run", "replay", "--data", folder, "--runs", 1, "--model", "odometry", "--sensors", "fix", "--sigma_gps", 2,
                    "--json", "-")
        host = json.loads(done.stdout)
        self.assertLess(host["metrics"]["error_m"]["mean"], 1.2)
        mine = pflight.replay.fly(folder, model="odometry", sensors=("fix",), sigma_gps=2.0)
        self.assertEqual(f"{mine.hash:016x}", host["hash"])

    def test_ranges_to_anchors(self):
        import pflight
        folder = self.folder / "anchors"
        folder.mkdir(exist_ok=True)
        random = np.random.default_rng(9)
        anchors = {3: (0.0, 0.0), 5: (20.0, 0.0), 6: (20.0, 15.0), 9: (0.0, 15.0)}
        t = np.arange(0, 40, 0.1)
        x, y = 10 + 6 * np.cos(0.2 * t), 7 + 5 * np.sin(0.2 * t)
        which = [list(anchors)[k % 4] for k in range(t.size)]
        ranges = [np.hypot(x[k] - anchors[a][0], y[k] - anchors[a][1]) for k, a in enumerate(which)] + random.normal(0, 0.1, t.size)
        ranges[26::50] += 8.0  # gross errors, not in the first one
        (folder / "anchors.csv").write_text("anchor_id,x_m,y_m\n" + "".join(f"{a},{p[0]},{p[1]}\n" for a, p in anchors.items()))
        (folder / "ranges.csv").write_text("t_s,anchor_id,range_m\n" +
                                           "".join(f"{a:.2f},{b},{c:.4f}\n" for a, b, c in zip(t, which, ranges)))
        (folder / "truth.csv").write_text("t_s,x_m,y_m\n" + "".join(f"{a:.2f},{b:.4f},{c:.4f}\n" for a, b, c in zip(t, x, y)))
        done = tool("run", "replay", "--data", folder, "--runs", 1, "--sensors", "range", "--sigma_range", 0.1, "--start_speed", 2,
                    "--particles", 1000, "--motion", 1, "--json", "-")
        host = json.loads(done.stdout)
        self.assertLess(host["metrics"]["error_m"]["mean"], 0.3)
        self.assertNotIn("nis", host["metrics"])
        mine = pflight.replay.fly(folder, sensors=("range",), sigma_range=0.1, start_speed=2.0, particles=1000, motion=1.0)
        self.assertEqual(f"{mine.hash:016x}", host["hash"])
        (folder / "anchors.csv").write_text("anchor_id,x_m,y_m\n3,0,0\n")
        self.assertIn("anchor 5 is not in anchors.csv", tool("run", "replay", "--data", folder, "--sensors", "range").stderr)

    def test_what_lacks_is_explained(self):
        for arguments, status, words in [
                (["--sensors", "fix"], 3, "the sensor fix needs gnss_fix.csv with the columns t_s, north_m, east_m"),
                (["--model", "odometry"], 3, "the model odometry needs odometry.csv"),
                (["--sensors", "velocity"], 2, "one of them must tell the position"),
                (["--sensors", "gps,range"], 3, "the sensor range needs ranges.csv with the columns t_s, anchor_id, range_m"),
                (["--sensors", "gps,baro"], 2, "--model hover"),
                (["--sensors", "gps,lidar"], 2, "gps, fix, velocity, height, baro, range"),
                (["--from", "9999"], 3, "no position after that"),
                (["--model"], 2, "--model needs a value")]:
            done = tool("run", "replay", "--data", self.log, *arguments)
            self.assertEqual((done.returncode, done.stdout), (status, ""), f"{arguments}: {done.stderr}")
            self.assertIn(words, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)
        (self.folder / "short").mkdir(exist_ok=True)
        (self.folder / "short/gps.csv").write_text("t_s,north_m\n0,1\n")
        done = tool("run", "replay", "--data", self.folder / "short")
        self.assertIn("no column 'east_m'", done.stderr)
        self.assertIn("the sensor gps needs gps.csv", done.stderr)

    def target_flies_it_too(self, folder, sensors, host):
        if shutil.which("arm-none-eabi-gcc") is None or shutil.which("qemu-system-arm") is None:
            return
        done = tool("target", "run", "replay", "--target", "cortex-m4f", "--set", f"sensors={sensors}", "--set", "motion=6",
                    "--json", "-", environment={"PFLIGHT_DATA": str(folder)})
        self.assertEqual(json.loads(done.stdout)["hash"], host["hash"], done.stderr)

    def test_behind_a_gap_a_flight_of_its_own_begins(self):
        """Two minutes later and two kilometres away; the same in C and Python, and a lost filter when it may not."""
        import pflight
        folder = self.folder / "pause"
        folder.mkdir(exist_ok=True)
        lines = (self.log / "gps.csv").read_text().splitlines()
        head = lines[0].split(",")
        rows = [line.split(",") for line in lines[1:]]
        for row in rows[70:]:
            row[0] = f"{float(row[0]) + 120:.6f}"
            row[head.index("north_m")] = f"{float(row[head.index('north_m')]) + 2000:.6f}"
        (folder / "gps.csv").write_text("\n".join([lines[0], *(",".join(row) for row in rows)]) + "\n")
        for model, sensors in [("cv", "gps,velocity"), ("turn", "gps"), ("hover", "gps,height")]:
            found = {}
            for gap in (60, 0):
                done = tool("run", "replay", "--data", folder, "--runs", 1, "--model", model, "--sensors", sensors, "--gap", gap,
                            "--motion", 6, "--json", "-")
                host = found[gap] = json.loads(done.stdout)
                mine = pflight.replay.fly(folder, model=model, sensors=tuple(sensors.split(",")), gap=gap, motion=6.0)
                self.assertEqual(f"{mine.hash:016x}", host["hash"], f"{model} {sensors} gap {gap}")
                self.assertEqual(host["metrics"]["restarts"]["mean"], 1 if gap else 0)
                if gap and model == "cv":
                    self.target_flies_it_too(folder, "gps,velocity", host)
            self.assertLess(found[60]["metrics"]["innovation_m"]["mean"], 4.0)
            self.assertGreater(found[0]["metrics"]["innovation_m"]["mean"], 100.0)  # so there is something to be gained

    def test_empty_cells_are_no_measurements(self):
        folder = self.folder / "gaps"
        folder.mkdir(exist_ok=True)
        lines = (self.log / "gps.csv").read_text().splitlines()
        head = lines[0].split(",")
        rows = [line.split(",") for line in lines[1:]]
        for row in rows[5::7]:
            row[head.index("north_m")] = ""
        (folder / "gps.csv").write_text("\n".join([lines[0], *(",".join(row) for row in rows)]) + "\n")
        import pflight
        host = json.loads(tool("run", "replay", "--data", folder, "--runs", 1, "--json", "-").stdout)
        self.assertLess(host["metrics"]["positions"]["mean"], 150 - 10)
        self.assertEqual(f"{pflight.replay.fly(folder).hash:016x}", host["hash"])


if __name__ == "__main__":
    unittest.main()
