# tools/run SCENARIO --live: what the runner tells, the page that shows it, and the terminal. Run by test/checks/live; needs
# nothing but Python 3, and opens the page when Chromium is there.
import fcntl
import http.client
import json
import os
import pathlib
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time
import unittest

import browser

ROOT = pathlib.Path(__file__).resolve().parents[2]
RUN = ROOT / "tools" / "run"
SHOTS = ROOT / "build" / "check-live"
SCENARIOS = ("land-vehicle", "uwb-range", "standoff", "uav-trajectory", "gps", "wind", "gps-fault", "car", "terrain", "sharp",
             "manoeuvre", "road-network")
WITHOUT_TRUTH = ("wind", "gps-fault")  # at least on one axis
QUIET = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}


def run(*arguments):
    return subprocess.run([str(RUN), *arguments], capture_output=True, stdin=subprocess.DEVNULL, text=True, env=QUIET,
                          timeout=100, check=False)


def numbers(step, name):
    return [x for x in step[name] if x is not None]


class Steps(unittest.TestCase):
    def looked_at(self, scenario):
        done = run(scenario, "--looks", "-")
        if done.returncode == 3 and "name the folder of the recordings" in done.stderr:
            self.skipTest(f"no recordings of {scenario}")
        self.assertEqual(("", 0), (done.stderr, done.returncode))
        head, *steps, end = done.stdout.splitlines()
        return [json.loads(line) for line in (head, *steps[::max(len(steps) // 500, 1)], end)]

    def test_each_scenario_has_steps_of_the_run_itself(self):
        for scenario in SCENARIOS:
            with self.subTest(scenario=scenario):
                head, *steps, end = self.looked_at(scenario)
                self.assertEqual(scenario, head["scenario"])
                self.assertGreater(len(steps), 50)
                alone = run(scenario, "--filter", head["settings"]["filter"], "--runs", "1", "--json", "-")
                self.assertEqual(json.loads(alone.stdout)["hash"], end["hash"])
                times = [step["t"] for step in steps]
                self.assertEqual(sorted(times), times)
                for step in steps:
                    self.assertEqual(2 * min(step["n"], 200), len(step["cloud"]))
                    self.assertTrue(all(sigma >= 0.0 for sigma in numbers(step, "sigma")))
                known = all(None not in step["truth"] for step in steps)
                self.assertEqual(scenario not in WITHOUT_TRUTH, known)
                self.assertTrue(any(step["resampled"] for step in steps) or scenario == "gps")

    def test_truth_lies_mostly_within_three_standard_deviations(self):
        for scenario in ("standoff", "road-network", "gps"):
            with self.subTest(scenario=scenario):
                steps = self.looked_at(scenario)[1:-1]
                inside = [abs(e - t) <= 3.0 * s for step in steps
                          for e, t, s in zip(step["estimate"], step["truth"], step["sigma"])]
                self.assertGreater(sum(inside) / len(inside), 0.8)

    def test_refusals(self):
        wrong = [(("--live",), "SCENARIO"), (("land-vehicle", "--live", "--rate", "0"), "--rate"),
                 (("land-vehicle", "--live", "--rate"), "--rate"), (("land-vehicle", "--live", "--json", "-"), "--live"),
                 (("land-vehicle", "--live", "--filter", "kf"), "particles"), (("car", "--live", "--filter", "odometry"), "particles"),
                 (("land-vehicle", "--live", "terminal"), "terminal"), (("land-vehicle", "--live"), "--live page"),
                 (("land-vehicle", "--looks", "-", "--trace", "-"), "--trace"), (("list", "--live"), "list"),
                 (("land-vehicle", "--live", "--nonsense", "1"), "--nonsense")]
        for arguments, word in wrong:
            with self.subTest(arguments=arguments):
                done = run(*arguments)
                if "name the folder of the recordings" in done.stderr:
                    continue
                self.assertEqual((2, ""), (done.returncode, done.stdout))
                self.assertRegex(done.stderr, r"\Arun: [^\n]+\n\Z")
                self.assertIn(word, done.stderr)


class Served:
    """The page of a scenario, by `with`; ended as a person ends it."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([str(RUN), *arguments, "--live", "page"], stdin=subprocess.DEVNULL,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=QUIET)
        self.line = self.process.stdout.readline()
        self.url = re.search(r"http://127\.0\.0\.1:(\d+)/", self.line)

    def __enter__(self):
        if self.url is None:
            self.process.kill()
            raise AssertionError(f"no address in {self.line!r}")
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.said = self.process.communicate(timeout=20)

    @property
    def port(self):
        return int(self.url.group(1))

    def get(self, path, host):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        connection.request("GET", path, headers={"Host": host})
        answer = connection.getresponse()
        return answer, answer.read().decode()


class Server(unittest.TestCase):
    def test_it_serves_this_machine_alone_and_ends_cleanly(self):
        with Served("land-vehicle") as served:
            own = f"127.0.0.1:{served.port}"
            listening = [line.split()[1] for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]
                         if line.split()[3] == "0A"]
            self.assertIn(f"0100007F:{served.port:04X}", listening)
            self.assertNotIn(f"00000000:{served.port:04X}", listening)
            answer, text = served.get("/", own)
            self.assertEqual(200, answer.status)
            self.assertIn("default-src 'none'", answer.headers["Content-Security-Policy"])
            self.assertNotRegex(text, r"""(?:src|href)=["'](?!data:)""")
            for path, host, status in (("/", "pages.example", 403), ("/../steps.py", own, 404), ("/none", own, 404)):
                self.assertEqual(status, served.get(path, host)[0].status)
            events = served.get("/steps", own)[1].split("\n\n")
            self.assertEqual(102, sum(event.startswith("data: {") for event in events))
            self.assertIn('event: end\ndata: ""', events)
        self.assertEqual((("", ""), 0), (served.said, served.process.returncode))


@unittest.skipUnless(browser.CHROMIUM, "Chromium is not installed")
class Page(unittest.TestCase):
    picture = "document.getElementById('cloud').toDataURL()"

    @classmethod
    def setUpClass(cls):
        cls.page = browser.Browser()

    @classmethod
    def tearDownClass(cls):
        cls.page.close()

    def settle(self, page):
        """Two frames: what was asked for is drawn."""
        page.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def test_particles_move_and_the_keyboard_rules_them(self):
        page = self.page
        with Served("road-network", "--rate", "20") as served:
            page.open(served.url.group())
            page.until("shown > 2")
            first = page.value(self.picture)
            page.until("shown > 6")
            self.assertNotEqual(first, page.value(self.picture))
            page.press(" ", " ")
            self.settle(page)
            paused, at_pause = page.value("shown"), page.value(self.picture)
            time.sleep(0.5)
            self.assertEqual((paused, at_pause), (page.value("shown"), page.value(self.picture)))
            page.value("window.without = {...steps[shown], cloud: []}, window.whole = steps[shown], steps[shown] = without, draw()")
            self.assertNotEqual(at_pause, page.value(self.picture), "the particles are not in the picture")
            page.value("steps[shown] = whole, draw()")
            self.assertEqual(at_pause, page.value(self.picture))
            page.press("ArrowRight")
            self.settle(page)
            self.assertEqual(paused + 1, page.value("shown"))
            self.assertNotEqual(at_pause, page.value(self.picture))
            page.press("ArrowLeft")
            self.assertEqual(paused, page.value("shown"))
            page.press("+", "+")
            self.assertEqual(40, page.value("rate"))
            page.press("f", "f")
            self.settle(page)
            self.assertNotEqual(at_pause, page.value(self.picture))
            page.press("Tab")
            self.assertEqual("seek", page.value("document.activeElement.id"))
            page.press("Tab")
            self.assertEqual("play", page.value("document.activeElement.id"))
            page.press(" ", " ")
            page.until("playing && shown > " + str(paused))
            page.until("ended && shown === steps.length - 1")
            self.assertIn(json.loads(run("road-network", "--runs", "1", "--json", "-").stdout)["hash"],
                          page.value("document.getElementById('what').textContent"))
            self.assertEqual([], page.console)

    def test_light_dark_and_phone(self):
        looks = {"light": {}, "dark": {"dark": True}, "phone": {"width": 390, "height": 844}}
        backs = set()
        page = self.page
        with Served("land-vehicle", "--rate", "100") as served:
            for name, options in looks.items():
                page.open(served.url.group(), **options)
                page.until("ended && !playing")
                page.screenshot(SHOTS / f"{name}.png")
                backs.add(page.value("getComputedStyle(document.body).backgroundColor"))
                self.assertLessEqual(page.value("document.documentElement.scrollWidth"),
                                     page.value("document.documentElement.clientWidth"))
                self.assertGreater((SHOTS / f"{name}.png").stat().st_size, 10000)
                self.assertEqual([], page.console)
        self.assertEqual(2, len(backs))

    def test_console_is_watched(self):
        self.page.open("data:text/html,<script>console.error('heard'); none()</script>")
        self.assertIn("heard", "".join(self.page.console))
        self.assertIn("none", "".join(self.page.console))


class Terminal:
    def __init__(self, *arguments):
        self.text = ""
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            os.execve(RUN, [str(RUN), *arguments], {**QUIET, "TERM": "xterm", "PYTHONIOENCODING": "utf-8"})
        fcntl.ioctl(self.fd, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 100, 0, 0))

    def read(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if select.select([self.fd], [], [], 0.05)[0]:
                try:
                    self.text += os.read(self.fd, 1 << 16).decode("utf-8", "replace")
                except OSError:
                    return  # it has ended
        return

    def frames(self):
        """The pictures that are complete."""
        return re.findall(r"\x1b\[H(.*?)\x1b\[J", self.text, re.S)

    def until_frames(self, count):
        for _ in range(200):
            if len(self.frames()) >= count:
                return
            self.read(0.1)
        raise AssertionError(f"only {len(self.frames())} pictures")

    def press(self, key, seconds=0.4):
        before = len(self.frames())
        os.write(self.fd, key)
        self.read(seconds)
        return len(self.frames()) - before

    def ended(self):
        """Its exit code."""
        self.read(5.0)
        os.close(self.fd)
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


class InTerminal(unittest.TestCase):
    def test_particles_move_and_keys_rule_them(self):
        terminal = Terminal("standoff", "--live")
        terminal.until_frames(8)
        pictures = [re.sub(r"[^\u2801-\u28ff\n]", " ", frame) for frame in terminal.frames()]
        self.assertGreater(len(set(pictures)), 4)
        self.assertRegex(pictures[-1], "[\u2801-\u28ff]")
        self.assertRegex(terminal.frames()[-1], r"effective sample size \[#+")
        terminal.press(b" ")
        self.assertIn("paused", terminal.frames()[-1])
        self.assertEqual(0, terminal.press(b""))
        self.assertEqual(1, terminal.press(b"n"))
        terminal.press(b"q")
        self.assertEqual(0, terminal.ended())
        self.assertTrue(terminal.text.endswith("\x1b[?25h\x1b[?1049l"))

    def test_interrupt(self):
        terminal = Terminal("land-vehicle", "--live", "terminal", "--rate", "1")
        terminal.until_frames(2)
        os.write(terminal.fd, b"\x03")
        self.assertEqual(0, terminal.ended())
        self.assertTrue(terminal.text.endswith("\x1b[?25h\x1b[?1049l"))


if __name__ == "__main__":
    unittest.main()
