"""Tests of the installed module: python -m unittest in this folder. They compile C with gcc to compare bits."""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import pflight as pf

ROOT = pathlib.Path(__file__).resolve().parents[3]
FLAGS = ["-std=c99", "-O2", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno"]


def library():
    """The library, built once, by its own list of files and for another optimisation than the module's."""
    archive = pathlib.Path(tempfile.gettempdir()) / f"pflight-python-test-{ROOT.stat().st_ino}.a"
    text = (ROOT / "lib/pflight.cmake").read_text()
    names = re.search(r"set\(PFLIGHT_LIB_SOURCES\n(.*?)\n\)", text, re.S).group(1).split()
    paths = [ROOT / "lib/src" / name for name in names] + [ROOT / "port/null/port_null.c"]
    newest = max(path.stat().st_mtime for path in ROOT.glob("lib/**/*.[ch]"))
    if archive.exists() and archive.stat().st_mtime > newest:
        return archive
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["gcc", *FLAGS, "-c", f"-I{ROOT}/lib/include", *map(str, paths)], check=True, cwd=folder)
        subprocess.run(["ar", "rcs", str(archive), *[path.with_suffix(".o").name for path in paths]], check=True, cwd=folder)
    return archive


def run_c(source):
    """What a C program with the library prints, the bits of its floats as numbers."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "program.c"
        path.write_text(source)
        subprocess.run(["gcc", *FLAGS, "-Wall", "-Wextra", "-Werror", f"-I{ROOT}/lib/include", str(path), str(library()),
                        "-o", str(path.with_suffix(""))], check=True)
        done = subprocess.run([str(path.with_suffix(""))], check=True, capture_output=True, text=True)
    return np.array([int(word, 16) for word in done.stdout.split()], np.uint32).view(np.float32)


C_MAIN = """
static void print_bits(const float *x, int n)
{
    for (int k = 0; k < n; k++) {
        uint32_t bits;
        memcpy(&bits, &x[k], 4);
        printf("%08x\\n", (unsigned)bits);
    }
}
int main(void)
{
    pfl_t *f;
    float mean[PFL_STATES_MAX];
    if (pfl_init(&filter_arena, sizeof filter_arena, &filter_config, 0, &f) != PFL_OK) return 1;
    for (int k = 0; k < STEPS; k++) {
        pfl_predict(f, (uint64_t)k * 100000u, NULL);
        pfl_update(f, 0, (uint64_t)k * 100000u, z[k]);
        if (pfl_estimate(f, mean, NULL) != PFL_OK) return 1;
        print_bits(mean, filter_config.states);
    }
    return 0;
}
"""


def walk(steps=120):
    random = np.random.default_rng(7)
    t = np.arange(steps) * 0.1
    return (np.column_stack([5 * t, 40 * np.sin(0.2 * t)]) + random.normal(0, 2, (steps, 2))).astype(np.float32)


def make_filter(particles=300, **more):
    return pf.Filter(pf.model("constant_velocity", sigma_accel=2.0), [pf.sensor("position", state=[0, 1], sigma=[2, 2])],
                     particles=particles, draw=pf.gaussian([0, 0, 5, 0], [3, 3, 2, 8]), seed=11, **more)


def times(z):
    return np.arange(len(z)) * 100000


class SameBits(unittest.TestCase):
    def test_the_build_computes_the_known_answers(self):
        pf.self_test()

    def test_the_printed_configuration_flies_in_c_with_the_same_bits(self):
        z = walk()
        f = make_filter()
        flight = f.run(times(z), 0, z)
        rows = ",\n".join("{" + ", ".join(float(x).hex() + "f" for x in row) + "}" for row in z)
        source = ('#include "pflight/pflight.h"\n#include <stdio.h>\n#include <string.h>\n'
                  f"#define STEPS {len(z)}\nstatic const float z[STEPS][2] = {{{rows}}};\n" + f.c_config() + C_MAIN)
        theirs = run_c(source).reshape(flight.mean.shape)
        np.testing.assert_array_equal(theirs.view(np.uint32), flight.mean.view(np.uint32))
        self.assertEqual(flight.hash, pf.hash_estimates(theirs))
        self.assertLess(np.sqrt(np.mean((flight.mean[40:, :2] - z[40:]) ** 2)), 3.0)

    def test_a_model_in_python_flies_with_the_bits_of_the_same_model_in_c(self):
        """The readme's filter, its callbacks once in C and once in Python, operation by operation."""
        readme = (ROOT / "README.md").read_text()
        callbacks = re.search(r"(static void climb.*?)int main", readme, re.S).group(1)
        source = ('#include "pflight/pflight.h"\n#include <stdio.h>\n#include <string.h>\n#define STEPS 100\n'
                  + callbacks + """
static float z[STEPS][1];
static const pfl_sensor_t sensors[] = {{.loglik = barometer}};
static const pfl_config_t filter_config = {.abi = PFL_ABI, .particles = 300, .states = 2, .noises = 1, .sensor_count = 1,
    .ess_ratio = 0.5f, .seed = 1, .sensors = sensors, .predict = climb};
PFL_ARENA(filter_arena, 300, 2, 1);
""" + C_MAIN.replace("pfl_t *f;", "pfl_t *f; for (int k = 0; k < STEPS; k++) z[k][0] = 0.25f * (float)k;"))
        source = source.replace("void *user,", "void *user __attribute__((unused)),", 2).replace(
            "const void *u,", "const void *u __attribute__((unused)),")

        def climb(x, w, dt_s, u):
            dt = np.float32(dt_s)
            x[0] += dt * x[1]
            x[1] += dt * w[0]

        def barometer(x, z):
            e = x[0] - np.float32(z)
            return np.float32(-2.0) * e * e

        f = pf.Filter(pf.python_model(climb, states=2, noises=1), [pf.python_sensor(barometer)], particles=300, seed=1)
        z = [0.25 * k for k in range(100)]
        mine = f.run(np.arange(100) * 100000, 0, z)
        theirs = run_c(source).reshape(mine.mean.shape)
        np.testing.assert_array_equal(theirs.view(np.uint32), mine.mean.view(np.uint32))

    def test_the_hash_is_fnv_1a(self):
        expected = 0xCBF29CE484222325
        x = np.array([1.5, -2.25e-3], np.float32)
        for byte in x.astype("<f4").tobytes():
            expected = ((expected ^ byte) * 0x100000001B3) % 2**64
        self.assertEqual(pf.hash_estimates(x), expected)


class Calls(unittest.TestCase):
    def test_a_snapshot_goes_on_with_the_same_bits(self):
        z = walk()
        f, g = make_filter(), make_filter()
        f.run(times(z)[:60], 0, z[:60])
        g.restore(f.snapshot())
        self.assertEqual(f.run(times(z)[60:], 0, z[60:]).hash, g.run(times(z)[60:], 0, z[60:]).hash)
        with self.assertRaises(pf.Error) as caught:
            g.restore(f.snapshot()[:-1])
        self.assertEqual(caught.exception.status, pf.Status.ERR_CORRUPT)

    def test_a_measurement_outside_its_gate_is_answered_not_raised(self):
        f = pf.Filter(pf.model("constant_velocity", sigma_accel=1.0), [pf.sensor("position", state=[0, 1], sigma=[1, 1],
                                                                               gate=9.2)], particles=200)
        f.predict(1000)
        self.assertEqual(f.update(0, 1000, [500.0, 0.0]), pf.Status.REJECTED)
        self.assertEqual(f.update(0, 1000, [0.0, 0.0]), pf.Status.OK)
        self.assertEqual(f.health()["rejected"], 1)

    def test_answers_agree_with_the_cloud(self):
        z = walk()
        f = make_filter(1000)
        f.run(times(z), 0, z)
        f.resample()  # equal weights
        x, log_weights = f.cloud()
        self.assertEqual(x.shape, (4, 1000))
        self.assertTrue(np.all(log_weights == log_weights[0]))
        self.assertAlmostEqual(f.quantile(0, 0.5), float(np.median(x[0])), delta=0.1)
        self.assertEqual(len(f.most_likely()), 4)
        self.assertTrue(0 < f.ess <= 1000)
        mean, cov = f.forecast(100000, 10)
        np.testing.assert_allclose(mean[-1, 0], x[0].mean() + x[2].mean(), atol=0.3)
        self.assertGreater(cov[-1, 0, 0], cov[0, 0, 0])
        f.reset(0)
        self.assertEqual(f.health()["resets"], 1)

    def test_inputs_and_measurements_by_field(self):
        f = pf.Filter(pf.model("odometry", speed_scale=1.0, sigma_position=0.01),
                      [pf.sensor("range", x_state=0, y_state=1, sigma=0.1, dof=3.0)], particles=500, circular=[2])
        for k in range(1, 11):
            f.predict(k * 100000, {"speed_mps": 1.0, "turn_radps": 0.0})
            f.update(0, k * 100000, {"anchor_x_m": 10.0, "range_m": 10.0 - 0.1 * k, "scale": 1.0})
        self.assertAlmostEqual(float(f.estimate().mean[0]), 1.0, delta=0.1)

    def test_errors_in_callbacks_come_out_and_leave_the_posterior(self):
        def loglik(x, z):
            if z is None:
                raise KeyError("no measurement")
            return -0.5 * (x[0] - z) ** 2

        f = pf.Filter(pf.model("constant_velocity", sigma_accel=1.0), [pf.python_sensor(loglik)], particles=100,
                      draw=pf.gaussian([0] * 4, [1] * 4))
        f.predict(1000)
        before = f.estimate().mean
        with self.assertRaises(KeyError):
            f.update(0, 1000, None)
        np.testing.assert_array_equal(f.estimate().mean, before)
        self.assertEqual(f.update(0, 1000, 0.5), pf.Status.OK)

    def test_a_sensor_in_python_cannot_change_particles(self):
        def loglik(x, z):
            x[0] = 0.0
            return np.zeros(x.shape[1])

        f = pf.Filter(pf.model("constant_velocity", sigma_accel=1.0), [pf.python_sensor(loglik)], particles=100)
        f.predict(1000)
        with self.assertRaises(ValueError):
            f.update(0, 1000, 0.0)

    def test_wrong_names_are_answered_with_the_right_ones(self):
        with self.assertRaisesRegex(ValueError, "sigma_accel, sigma_position"):
            pf.model("constant_velocity", sigma=1.0)
        with self.assertRaisesRegex(ValueError, "land_vehicle"):
            pf.model("boat")
        with self.assertRaisesRegex(ValueError, "range_bearing"):
            pf.sensor("sonar")
        with self.assertRaisesRegex(ValueError, "at most 4"):
            pf.sensor("position", state=[0] * 5, sigma=[1] * 5)
        with self.assertRaises(pf.Error) as caught:
            make_filter(particles=0)
        self.assertEqual(caught.exception.status, pf.Status.ERR_CONFIG)
        with self.assertRaises(pf.Error):
            make_filter().update(1, 0, [0, 0])

    def test_the_version_is_the_library_s(self):
        self.assertIn(f"project(pflight VERSION {pf.__version__} ", (ROOT / "CMakeLists.txt").read_text())

    def test_every_ready_model_and_sensor_is_there_and_starts(self):
        header = (ROOT / "lib/include/pflight/models.h").read_text()
        self.assertEqual(set(re.findall(r"void pfl_(\w+)_predict\(", header)), set(pf.models()))
        header = (ROOT / "lib/include/pflight/sensors.h").read_text()
        self.assertLessEqual(set(re.findall(r"void pfl_(\w+)_loglik\(", header)), set(pf.sensors()))
        for name in pf.models():
            axes = {"axes": 2} if "axes" in pf.models()[name] else {}
            pf.Filter(pf.model(name, **axes), [], particles=10)

    def test_laws_and_nested_parameters(self):
        law = pf.Structure("pfl_student_law_t", {"sigma": 1.0, "dof": 3.0})
        f = pf.Filter(pf.model("constant_velocity", sigma_accel=1.0),
                      [pf.sensor("scalar", state=0, bias_state=0xFFFF, law="pfl_student_law", parameters=law)],
                      particles=100, draw=pf.gaussian([0] * 4, [1] * 4))
        f.predict(1000)
        self.assertEqual(f.update(0, 1000, [0.3]), pf.Status.OK)


class TypeHints(unittest.TestCase):
    def test_mypy_strict(self):
        package = pathlib.Path(__file__).resolve().parents[1]
        done = subprocess.run([sys.executable, "-m", "mypy", "--config-file", str(package / "pyproject.toml"), "--cache-dir",
                               str(ROOT / "build/mypy"), str(package / "src/pflight")], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
