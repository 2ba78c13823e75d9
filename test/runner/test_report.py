# What tools/run writes for all scenarios, tools/run compare, traces, and the report in a browser. Run by
# test/checks/report; needs nothing but Python 3, and opens the page when Chromium is there.
import csv
import html.parser
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

import browser

ROOT = pathlib.Path(__file__).resolve().parents[2]
RUN = ROOT / "tools" / "run"
REPORT = ROOT / "tools" / "report"
SHOTS = ROOT / "build" / "check-report"
LAND = "land-vehicle"
CHROMIUM = browser.CHROMIUM
SCREENS = {"light": ("1280,4000", 1), "dark": ("1280,4000", 0), "phone": ("390,4000", 1)}

VOID = {"meta", "link", "br", "img"}


def run(*arguments, cwd=None):
    return subprocess.run([str(RUN), *arguments], capture_output=True, stdin=subprocess.DEVNULL, text=True, cwd=cwd,
                          timeout=900, check=False)


def refuse_constant(name):
    raise ValueError(f"{name} is no JSON")


def parse(path):
    return json.loads(pathlib.Path(path).read_text(encoding="utf-8"), parse_constant=refuse_constant)


def rows_of(path):
    with open(path, encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def has_matplotlib():
    for python in (ROOT / "build/report-venv/bin/python", "python3", "/usr/bin/python3"):
        if shutil.which(python) and subprocess.run([python, "-c", "import matplotlib"], capture_output=True,
                                                   check=False).returncode == 0:
            return True
    return False


def setUpModule():
    """All scenarios once, for all that looks at the results."""
    global folder, out, everything
    folder = tempfile.TemporaryDirectory()
    out = pathlib.Path(folder.name) / "out"
    everything = run("--runs", "20", "--seed", "2", cwd=folder.name)


def tearDownModule():
    folder.cleanup()


class Summary(unittest.TestCase):
    def test_exit_code_and_streams(self):
        accepted = parse(out / "summary.json")["accepted"]
        self.assertEqual(("", 0 if accepted else 1), (everything.stderr, everything.returncode))
        self.assertIn("the report is in out/report.html", everything.stdout)
        self.assertEqual({"summary.json", "junit.xml", "report.html", "csv"}, set(os.listdir(out)))

    def test_summary_says_how_each_metric_is_judged(self):
        summary = parse(out / "summary.json")
        self.assertEqual({"schema", "accepted", "studies", "skipped"}, set(summary))
        self.assertEqual(1, summary["schema"])
        self.assertEqual(summary["accepted"], all(study["accepted"] for study in summary["studies"]))
        ids = [study["id"] for study in summary["studies"]]
        self.assertEqual(len(ids), len(set(ids)))
        for study in summary["studies"]:
            verdicts = [study["timing"]["verdict"]]
            for name, metric in study["metrics"].items():
                self.assertEqual({"mean", "stderr", "paper", "reference", "lo", "hi", "verdict"}, set(metric), name)
                verdicts.append(metric["verdict"])
                if metric["verdict"] is not None:
                    lo = -math.inf if metric["lo"] is None else metric["lo"]
                    hi = math.inf if metric["hi"] is None else metric["hi"]
                    self.assertEqual("pass" if lo <= metric["mean"] <= hi else "fail", metric["verdict"])
            self.assertLessEqual(set(verdicts), {"pass", "fail", None})
            self.assertEqual(study["accepted"], "fail" not in verdicts, study["id"])

    def test_a_study_is_what_the_scenario_alone_prints(self):
        printed = json.loads(run(LAND, "--runs", "20", "--set", "case=2", "--json", "-").stdout)
        study = next(study for study in parse(out / "summary.json")["studies"] if study["id"] == f"{LAND}-pf-case-2")
        self.assertLessEqual(set(printed), set(study))
        self.assertEqual((printed["hash"], printed["settings"]), (study["hash"], study["settings"]))
        for name, metric in printed["metrics"].items():
            self.assertEqual(metric, {key: study["metrics"][name][key] for key in metric})

    def test_time_series(self):
        for study in parse(out / "summary.json")["studies"]:
            mean = rows_of(out / study["csv"])
            trace = rows_of(out / study["trace"])
            self.assertEqual(len(mean), len(trace), study["id"])
            self.assertEqual([str(k) for k in range(1, len(mean) + 1)], [row["k"] for row in mean])
            self.assertLessEqual(set(mean[0]), set(trace[0]))
            if study["cloud"] is not None:
                self.assertEqual(["set", "t_s", "x", "y"], list(rows_of(out / study["cloud"])[0]))

    def test_junit(self):
        suites = xml.etree.ElementTree.parse(out / "junit.xml").getroot()
        summary = parse(out / "summary.json")
        self.assertEqual("testsuites", suites.tag)
        for suite in suites:
            cases = suite.findall("testcase")
            self.assertEqual(int(suite.get("tests")), len(cases))
            self.assertEqual(int(suite.get("failures")), len(suite.findall("testcase/failure")))
            self.assertEqual(int(suite.get("skipped")), len(suite.findall("testcase/skipped")))
        judged = {(study["scenario"], f"{study['scenario']}.{study['id']}", name, metric["verdict"] == "fail")
                  for study in summary["studies"] for name, metric in study["metrics"].items() if metric["verdict"]}
        found = {(suite.get("name"), case.get("classname"), case.get("name"), case.find("failure") is not None)
                 for suite in suites for case in suite if case.get("name") not in ("budget_p50_us", "recordings")}
        self.assertEqual(judged, found)

    def test_folder_that_cannot_be_written(self):
        with tempfile.TemporaryDirectory() as place:
            pathlib.Path(place, "file").write_text("kept")
            for where in ("file", "none/out"):
                done = run("--out", where, cwd=place)
                self.assertEqual((3, ""), (done.returncode, done.stdout))
                self.assertRegex(done.stderr, r"\Arun: [^\n]+\n\Z")
                self.assertIn(where, done.stderr)
            self.assertEqual(["file"], os.listdir(place))

    def test_one_scenario_writes_nothing(self):
        with tempfile.TemporaryDirectory() as place:
            self.assertEqual(0, run(LAND, "--runs", "2", cwd=place).returncode)
            self.assertEqual([], os.listdir(place))


class Compare(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def write(self, name, *arguments):
        path = pathlib.Path(self.folder.name, name)
        done = run(LAND, "--runs", "30", *arguments, "--json", str(path))
        self.assertEqual(0, done.returncode, done.stderr)
        return str(path)

    def edited(self, path, edit):
        data = parse(path)
        edit(data)
        other = path + ".edited.json"
        pathlib.Path(other).write_text(json.dumps(data), encoding="utf-8")
        return other

    def test_exit_codes(self):
        a, b, c = (self.write(f"{i}.json", *line) for i, line in
                   enumerate([(), ("--seed", "3"), ("--set", "case=3")]))
        self.assertEqual([0, 0, 1], [run("compare", a, other).returncode for other in (a, b, c)])
        done = run("compare", a, c)
        self.assertRegex(done.stdout, r"(?m)^  eta +[\d.]+ +[\d.]+ +\+[\d.]+ +[\d.]+  YES$")

    def test_three_combined_errors_are_the_limit(self):
        a = self.write("a.json")

        def shifted(errors):
            def edit(data):
                metric = data["metrics"]["eta"]
                metric["mean"] += errors * math.sqrt(2.0) * metric["stderr"]
                data["hash"] = "0" * 16
            return edit

        for errors, code in ((2.9, 0), (-2.9, 0), (3.1, 1), (-3.1, 1)):
            self.assertEqual(code, run("compare", a, self.edited(a, shifted(errors))).returncode, errors)

    def test_rounding_is_no_difference(self):
        a = self.write("a.json", "--filter", "ukf")
        b = self.write("b.json", "--filter", "ukf", "--seed", "3")
        self.assertLess(parse(a)["metrics"]["eta_ratio_kf"]["stderr"], 1e-15)
        self.assertEqual(0, run("compare", a, b).returncode)

    def test_a_metric_that_one_side_lacks_differs(self):
        a = self.write("a.json")
        b = self.edited(a, lambda data: data["metrics"].pop("eta") and data.update(hash="0" * 16))
        self.assertEqual(1, run("compare", a, b).returncode)

    def test_summaries(self):
        summary = str(out / "summary.json")
        self.assertEqual(0, run("compare", summary, summary).returncode)
        fewer = pathlib.Path(self.folder.name, "fewer.json")
        data = parse(summary)
        data["studies"].pop()
        fewer.write_text(json.dumps(data), encoding="utf-8")
        done = run("compare", summary, str(fewer))
        self.assertEqual(1, done.returncode)
        self.assertIn("only in A", done.stdout)
        self.assertEqual(0, run("compare", summary, self.write("a.json")).returncode)

    def test_usage(self):
        for arguments in ((), ("a.json",), ("a.json", "b.json", "c.json"), ("--no", "a.json")):
            done = run("compare", *arguments)
            self.assertEqual((2, ""), (done.returncode, done.stdout))
            self.assertRegex(done.stderr, r"\Ausage: [^\n]+\n\Z")

    def test_unreadable(self):
        a = self.write("a.json")
        broken = {"none.json": None, "empty.json": "", "half.json": '{"schema":1,', "list.json": "[1]",
                  "other.json": '{"schema":2,"studies":[]}', "nan.json": '{"schema":NaN}',
                  "text.json": '{"schema":1,"settings":{},"scenario":"x","hash":"0","metrics":{"m":{"mean":"1"}}}'}
        for name, text in broken.items():
            with self.subTest(name=name):
                path = pathlib.Path(self.folder.name, name)
                if text is not None:
                    path.write_text(text, encoding="utf-8")
                done = run("compare", a, str(path))
                self.assertEqual((3, ""), (done.returncode, done.stdout))
                self.assertRegex(done.stderr, r"\Acompare: [^\n]+\n\Z")
                self.assertIn(name, done.stderr)


class Trace(unittest.TestCase):
    def test_it_is_the_run(self):
        with tempfile.TemporaryDirectory() as place:
            done = run(LAND, "--seed", "5", "--trace", "t.csv", cwd=place)
            self.assertEqual((0, ""), (done.returncode, done.stderr))
            one = run(LAND, "--seed", "5", "--runs", "1", "--csv", ".", "--json", "o.json", cwd=place)
            self.assertEqual(0, one.returncode, one.stderr)
            result = parse(pathlib.Path(place, "o.json"))
            trace = rows_of(pathlib.Path(place, "t.csv"))
            alone = rows_of(pathlib.Path(place, f"{LAND}.csv"))
            self.assertEqual(alone, [{key: row[key] for key in alone[0]} for row in trace])
            self.assertIn(result["hash"], done.stdout)
            self.assertEqual(result["metrics"]["resampled_share"]["mean"],
                             sum(int(row["resampled"]) for row in trace) / len(trace))
            for row in trace:
                self.assertTrue(1.0 <= float(row["ess"]) <= 300.01)
                self.assertLessEqual(int(row["resample_ns"]), int(row["cycles_ns"]))
                self.assertLess(abs(float(row["estimate_east_m"]) - float(row["truth_east_m"])), 20.0)

    def test_other_runs_and_standard_output(self):
        first, second, other = (run(LAND, "--trace", "-", *line).stdout for line in ((), (), ("--trace-run", "3")))
        timeless = [[line.rsplit(",", 2)[0] for line in text.splitlines()] for text in (first, second, other)]
        self.assertEqual(timeless[0], timeless[1])
        self.assertEqual(len(timeless[0]), len(timeless[2]))
        self.assertNotEqual(timeless[0], timeless[2])

    def test_refusals(self):
        wrong = [((LAND, "--trace-run", "1"), "--trace"), ((LAND, "--cloud", "c.csv"), "--trace"),
                 ((LAND, "--trace", ""), "--trace"), ((LAND, "--trace", "t", "--json", "-"), "--json"),
                 ((LAND, "--trace", "t", "--csv", "d"), "--csv"), ((LAND, "--trace", "t", "--trace-run", "x"), "'x'"),
                 (("--trace", "t"), "SCENARIO"), ((LAND, "--out", "o"), "--out"), (("list", "--out", "o"), "list")]
        with tempfile.TemporaryDirectory() as place:
            for arguments, word in wrong:
                with self.subTest(arguments=arguments):
                    done = run(*arguments, cwd=place)
                    self.assertEqual((2, ""), (done.returncode, done.stdout))
                    self.assertRegex(done.stderr, r"\Arun: [^\n]+\n\Z")
                    self.assertIn(word, done.stderr)
            self.assertEqual([], os.listdir(place))
            self.assertEqual(3, run(LAND, "--trace", "none/t.csv", cwd=place).returncode)


class Budget(unittest.TestCase):
    def test_the_p50_decides(self):
        for budget, code, word in (("0.001", 1, "FAIL: p50 over it"), ("1e6", 0, "PASS")):
            done = run(LAND, "--runs", "3", "--budget-us", budget)
            self.assertEqual(code, done.returncode)
            self.assertRegex(done.stdout, rf"(?m)^  filter cycle: p50 .*; budget .*{re.escape(word)}$")
            self.assertRegex(done.stdout, r"(?m)^  of it resampling: p50 [\d.]+ us, p99 [\d.]+ us, max [\d.]+ us, in ")


class Page(html.parser.HTMLParser):
    """Checks that elements are closed, ids are unique and references stay inside, and collects the figures."""

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.references, self.problems = [], set(), set(), []
        self.figures, self.titles, self.figure = {}, {}, None

    def handle_starttag(self, tag, attributes):
        names = dict(attributes)
        if tag == "script" or any(name.startswith("on") for name in names):
            self.problems.append(f"a script in <{tag}>")
        for name in ("src", "href", "xlink:href"):
            reference = names.get(name, "")
            if reference and not reference.startswith(("#", "data:")):
                self.problems.append(f"{name}={reference}")
            if reference.startswith("#"):
                self.references.add(reference[1:])
        self.references.update(re.findall(r"url\(#([^)]*)\)", " ".join(value or "" for value in names.values())))
        if "id" in names:
            if names["id"] in self.ids:
                self.problems.append(f"id {names['id']} twice")
            self.ids.add(names["id"])
        if tag == "figure":
            self.figure = names["id"]
            self.figures[self.figure] = False
        if tag == "svg":
            self.figures[self.figure] = True
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.problems.append(f"</{tag}> closes something else")

    def handle_data(self, data):
        if self.open[-2:] == ["figcaption", "b"]:
            self.titles[self.figure] = data


def page_of(path):
    page = Page()
    page.feed(path.read_text(encoding="utf-8"))
    page.close()
    return page


# Of every scenario; whose recording has no truth, has no errors either.
ONE_RUN = ("bands", "inside", "ess", "flags", "clouds", "cycles")
WITHOUT_TRUTH = ("wind",)


class Report(unittest.TestCase):
    # What each scenario's papers show; a scenario that is skipped for want of its recordings has no figures.
    figures = {
        LAND: ["route-1", "route-2", "route-3", "error-1", "error-2", "error-3", "eta"],
        "uwb-range": ["track-los_a1", "error-los_a1", "cdf"],
        "uav-trajectory": ["clouds-line", "clouds-circle-on", "clouds-circle-off", "spread", "forecast",
                           "forecast-error", "wind", "replay"],
        "standoff": ["orbits-lvfg", "orbits-nmpc", "field", "position", "distance", "particles", "phase"],
        "gps": ["line", "line-error", "curve", "curve-error"],
        "terrain": ["error-1", "track-1", "error-2", "track-2"],
        "wind": ["wind-px4", "offset-px4", "wind-x8", "offset-x8"],
        "gps-fault": ["height", "flag"],
        "car": ["track", "error"],
        "road-network": ["track", "error"],
    }

    def test_page_is_sound_and_self_contained(self):
        page = page_of(out / "report.html")
        self.assertEqual([], page.problems)
        self.assertEqual([], page.open)
        self.assertLessEqual(page.references, page.ids)

    def test_each_study_has_its_table(self):
        text = (out / "report.html").read_text(encoding="utf-8")
        for study in parse(out / "summary.json")["studies"]:
            self.assertIn(f'<h4 id="{study["id"]}">', text)
            self.assertEqual(1, text.count(f'aria-label="Metrics of {study["id"]}"'))

    @unittest.skipUnless(has_matplotlib(), "matplotlib is not installed")
    def test_each_figure_is_drawn(self):
        page = page_of(out / "report.html")
        text = (out / "report.html").read_text(encoding="utf-8")
        self.assertEqual([], re.findall(r"not drawn: [^<]*", text))
        self.assertEqual(set(page.figures), set(page.titles))
        for scenario in {study["scenario"] for study in parse(out / "summary.json")["studies"]}:
            for name in self.figures.get(scenario, []):
                self.assertTrue(page.figures.get(f"fig-{scenario}-{name}"), f"{scenario}-{name}")

    @unittest.skipUnless(has_matplotlib(), "matplotlib is not installed")
    def test_each_scenario_has_one_run_step_by_step(self):
        page = page_of(out / "report.html")
        for scenario in {study["scenario"] for study in parse(out / "summary.json")["studies"]}:
            for name in ONE_RUN:
                there = scenario not in WITHOUT_TRUTH or name != "inside"
                self.assertEqual(there, page.figures.get(f"fig-{scenario}-{name}", False), f"{scenario}-{name}")

    @unittest.skipUnless(has_matplotlib(), "matplotlib is not installed")
    def test_figures_say_what_the_run_did(self):
        """Ticks where the filter resampled, the flags of the fault, the share of errors inside the bands, the budget."""
        text = (out / "report.html").read_text(encoding="utf-8")
        studies = parse(out / "summary.json")["studies"]

        def figure(name):
            return text[text.index(f'<figure id="fig-{name}">'):].split("</figure>")[0]

        study = next(study for study in studies if study["id"] == f"{LAND}-pf")
        steps = [json.loads(line) for line in (out / study["look"]).read_text().splitlines()][1:]
        self.assertEqual(study["look"], f"csv/{LAND}-pf.look.jsonl")
        ticks = max(re.findall(r' d="([^"]*)"', figure(f"{LAND}-ess").split("legend")[0]), key=lambda d: d.count("M"))
        self.assertEqual(sum(step["resampled"] for step in steps), ticks.count("M"))
        inside = [abs(step["estimate"][0] - step["truth"][0]) <= 3.0 * step["sigma"][0] for step in steps]
        self.assertIn(f"{100.0 * sum(inside) / len(inside):.1f} % inside", figure(f"{LAND}-inside"))
        clouds = [d.count("M") for d in re.findall(r' d="([^"]*)"', figure(f"{LAND}-clouds"))]
        self.assertEqual(6, clouds.count(200))
        for word in ("budget", "cortex-m4f, N = 300", "rv32imafc"):
            self.assertIn(word, figure(f"{LAND}-cycles"))
        self.assertIn("no flag was raised", figure(f"{LAND}-flags"))
        self.assertIn("phase lost", figure("road-network-flags"))
        if any(study["scenario"] == "gps-fault" for study in studies):
            for word in ("phase degraded", "refused sensor 1", "mode usable"):
                self.assertIn(word, figure("gps-fault-flags"))

    def test_without_matplotlib(self):
        with tempfile.TemporaryDirectory() as place:
            pathlib.Path(place, "matplotlib.py").write_text("raise ImportError\n")
            shutil.copy(out / "summary.json", place)
            done = subprocess.run(["python3", "-B", str(REPORT / "report.py"), place], capture_output=True, text=True,
                                  env={**os.environ, "PYTHONPATH": place}, timeout=60, check=False)
            self.assertEqual((0, ""), (done.returncode, done.stderr))
            page = page_of(pathlib.Path(place, "report.html"))
            self.assertEqual([], page.problems)
            self.assertFalse(any(page.figures.values()))
            self.assertIn("not drawn: matplotlib is not installed", pathlib.Path(place, "report.html").read_text())

    def test_without_results(self):
        with tempfile.TemporaryDirectory() as place:
            for text in (None, "{", '{"schema":2}', '{"schema":1,"accepted":true,"studies":[{}],"skipped":[]}'):
                if text is not None:
                    pathlib.Path(place, "summary.json").write_text(text)
                done = subprocess.run(["python3", "-B", str(REPORT / "report.py"), place], capture_output=True,
                                      text=True, timeout=60, check=False)
                self.assertEqual((3, ""), (done.returncode, done.stdout))
                self.assertRegex(done.stderr, r"\Areport: [^\n]+\n\Z")


class Skipped(unittest.TestCase):
    def test_names_that_need_escaping_reach_every_file(self):
        with tempfile.TemporaryDirectory() as place:
            missing = 'no<such>&"folder'
            done = run("--runs", "2", "--data", missing, "--out", "made", cwd=place)
            self.assertEqual(("", 0), (done.stderr, done.returncode))
            made = pathlib.Path(place, "made")
            skipped = parse(made / "summary.json")["skipped"]
            self.assertEqual(["uwb-range", "wind", "gps-fault", "car", "terrain"], [entry["scenario"] for entry in skipped])
            self.assertIn(missing, skipped[0]["reason"])
            suites = xml.etree.ElementTree.parse(made / "junit.xml").getroot()
            self.assertEqual([entry["reason"] for entry in skipped],
                             [case.get("message") for case in suites.iter("skipped")])
            page = page_of(made / "report.html")
            self.assertEqual(([], []), (page.problems, page.open))
            self.assertIn("uwb-range", page.ids)


@unittest.skipUnless(CHROMIUM, "Chromium is not installed")
class Browser(unittest.TestCase):
    def chromium(self, path, *arguments):
        with tempfile.TemporaryDirectory() as profile:
            return subprocess.run(
                [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars",
                 "--disable-background-networking", "--disable-component-update", "--disable-sync",
                 "--disable-dev-shm-usage", "--enable-logging=stderr", f"--user-data-dir={profile}", *arguments,
                 path.as_uri()],
                capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=120, check=True)

    @staticmethod
    def console(done):
        return [line for line in done.stderr.splitlines() if "CONSOLE" in line]

    def test_console_is_watched(self):
        with tempfile.TemporaryDirectory() as place:
            path = pathlib.Path(place, "noisy.html")
            path.write_text("<!DOCTYPE html><script>console.error('heard')</script>")
            self.assertIn("heard", "".join(self.console(self.chromium(path, "--dump-dom"))))

    def test_page_opens_without_a_word_and_has_each_title(self):
        done = self.chromium(out / "report.html", "--dump-dom")
        self.assertEqual([], self.console(done))
        titles = page_of(out / "report.html").titles
        self.assertGreater(len(titles), 10)
        for title in titles.values():
            self.assertIn(title.replace("&", "&amp;"), done.stdout)

    def test_keyboard(self):
        with browser.Browser((out / "report.html").as_uri()) as page:
            focused = "document.activeElement"
            page.press("Tab")
            self.assertEqual("Skip to the results", page.value(f"{focused}.textContent"))
            self.assertGreaterEqual(page.value(f"{focused}.getBoundingClientRect().left"), 0)
            page.press("Enter", "\r")
            page.until(f"{focused}.id === 'main'")
            order = []
            for _ in range(400):  # to the first fold: all on the way is a link, a table or a fold
                page.press("Tab")
                order.append(page.value(f"{focused}.tagName"))
                if order[-1] == "SUMMARY":
                    break
            self.assertEqual("SUMMARY", order[-1])
            self.assertLessEqual(set(order), {"A", "DIV", "SUMMARY"})
            folded = page.value(f"{focused}.parentElement.open")
            page.press("Enter", "\r")
            self.assertEqual(not folded, page.value(f"{focused}.parentElement.open"))
            page.value("document.querySelector('nav a').focus()")
            page.press("Enter", "\r")
            page.until("document.querySelector(':target') !== null")
            self.assertEqual("H2", page.value("document.querySelector(':target').tagName"))
            self.assertEqual([], page.console)

    def test_phone_needs_no_sideways_scrolling(self):
        with browser.Browser((out / "report.html").as_uri(), width=390, height=844, dark=True) as page:
            self.assertLessEqual(page.value("document.documentElement.scrollWidth"), 390)
            page.screenshot(SHOTS / "phone-dark.png")

    def test_screenshots(self):
        SHOTS.mkdir(parents=True, exist_ok=True)
        for name, (size, scheme) in SCREENS.items():
            path = SHOTS / f"{name}.png"
            path.unlink(missing_ok=True)
            self.chromium(out / "report.html", f"--window-size={size}", f"--screenshot={path}",
                          f"--blink-settings=preferredColorScheme={scheme}")
            self.assertGreater(path.stat().st_size, 50000, name)


if __name__ == "__main__":
    unittest.main()
