#!/usr/bin/env python3
"""Draws the report of `tools/run`: reads DIR/summary.json and DIR/csv, writes DIR/report.html.

usage: report.py DIR. Without matplotlib the page has all tables, and says so where a figure belongs.
"""
import importlib
import importlib.util
import os
import pathlib
import sys
import warnings

import data
import one_run
import page

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXIT_USAGE, EXIT_UNREADABLE = 2, 3


class Topic:
    """Studies that no topic of their scenario took, or whose scenario has no figures yet."""

    figures = ()

    def __init__(self, scenario):
        self.id = f"{scenario}-more"
        self.title = "More studies"


def topics_of(scenario, results, lacks):
    """Its own, if it has any; and, where there are plots, that of one run, which all have."""
    name = f"figures_{scenario.replace('-', '_')}"
    own = importlib.import_module(name).TOPICS if importlib.util.find_spec(name) is not None else ()
    run = one_run.topic(results, scenario) if lacks is None else None
    return (*own, run) if run is not None else own


def prepare_plots():
    """Answers why there can be no plots, or None."""
    cache = ROOT / "build" / "report-cache"
    os.environ.setdefault("MPLCONFIGDIR", str(cache))
    try:
        cache.mkdir(parents=True, exist_ok=True)
        import matplotlib
    except (ImportError, OSError):
        return "matplotlib is not installed; tools/setup report installs it"
    import style

    matplotlib.use("svg")
    matplotlib.rcParams.update(style.RC)
    warnings.filterwarnings("ignore", module="matplotlib")
    return None


def drawn(figure, results, lacks):
    """A figure as HTML. lacks: why there can be no plots at all, or None."""
    svg = None
    if lacks is None:
        import style

        try:
            svg = style.to_svg(figure.draw(results), f"fig-{figure.id}-svg", figure.title, figure.caption)
        except data.NotDrawn as reason:
            lacks = reason
    return page.figure_section(figure, svg, lacks)


def scenario_sections(scenario, results, lacks):
    left = [study for study in results.studies if study.scenario == scenario]
    sections = []
    for topic in topics_of(scenario, results, lacks):
        mine = [study for study in left if topic.owns(study)]
        left = [study for study in left if study not in mine]
        sections.append(page.topic_section(topic, [drawn(figure, results, lacks) for figure in topic.figures], mine))
    if left:
        sections.append(page.topic_section(Topic(scenario), [], left))
    return sections


def main(arguments):
    if len(arguments) != 1:
        print("usage: report.py DIR", file=sys.stderr)
        return EXIT_USAGE
    folder = pathlib.Path(arguments[0])
    path = folder / "report.html"
    try:
        results = data.Results(folder)
        lacks = prepare_plots()
        names = dict.fromkeys(study.scenario for study in results.studies)
        text = page.page(results, {name: scenario_sections(name, results, lacks) for name in names})
        temporary = folder / f"report.html.tmp.{os.getpid()}"
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except data.Unreadable as error:
        print(f"report: {error}", file=sys.stderr)
        return EXIT_UNREADABLE
    except OSError as error:
        print(f"report: cannot write '{path}': {error.strerror}", file=sys.stderr)
        return EXIT_UNREADABLE
    print(f"the report is in {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
