"""Figures that every scenario has: run number 0 of one study, step by step, as its filter saw it."""
import json
import pathlib
import sys

import style
from topics import Figure, Topic

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tools/live"))
import steps as live  # noqa: E402  pylint: disable=wrong-import-position

POINTS = 450  # of a line; more cannot be told apart
INSTANTS = 6


def shown(results, scenario):
    """The first study that has particles to look at; None: there is none."""
    return next((study for study in results.studies if study.scenario == scenario and study.has_look), None)


def thin(look):
    return slice(None, None, max(len(look) // POINTS, 1))


def draw_bands(study):
    """Truth and estimate over time, with three standard deviations."""
    def draw(_):
        look = study.look
        figure, rows = style.new_figure(4.4, rows=2, sharex=True)
        few = thin(look)
        t = look["t"][few]
        for a, axes in enumerate(rows):
            mean, three = look["estimate"][few, a], 3.0 * look["sigma"][few, a]
            axes.fill_between(t, mean - three, mean + three, color=style.BAND, linewidth=0, label="3 sigma")
            axes.plot(t, mean, color=style.OURS, linewidth=1.2, label="estimate")
            if a in known(look):
                axes.plot(t, look["truth"][few, a], color=style.INK, linewidth=0.9, linestyle="--", label=look.against)
            axes.set(ylabel=look.axes[a])
        rows[1].set(xlabel="time [s]")
        handles = {label: handle for axes in rows for handle, label in zip(*axes.get_legend_handles_labels())}
        figure.legend(handles.values(), handles.keys(), loc="outside upper left", ncols=3)
        return figure
    return draw


def known(look):
    """The axes whose truth is known."""
    import numpy

    return [a for a in range(2) if numpy.isfinite(look["truth"][:, a]).any()]


def symmetric_ticks(usual, most):
    """Of an axis that is linear about zero and logarithmic beyond."""
    from math import ceil, log10
    from matplotlib.ticker import FixedLocator

    tens = [10.0 ** k for k in range(ceil(log10(2.0 * usual)), ceil(log10(most)) + 1)]
    return FixedLocator([-ten for ten in tens] + [0.0] + tens)


def draw_inside(study):
    def draw(_):
        import numpy

        look = study.look
        seen = known(look)
        figure, rows = style.new_figure(2.0 * len(seen) + 0.4, rows=len(seen), sharex=True, squeeze=False)
        few = thin(look)
        t = look["t"][few]
        for axes, a in zip(rows[:, 0], seen):
            error, three = look["estimate"][:, a] - look["truth"][:, a], 3.0 * look["sigma"][:, a]
            share = numpy.mean(abs(error) <= three)
            axes.fill_between(t, -three[few], three[few], color=style.BAND, linewidth=0, label="3 sigma")
            axes.plot(t, error[few], color=style.OURS, linewidth=1.0, label="error")
            axes.set(ylabel=f"error, {look.axes[a]}")
            usual = numpy.nanmedian(three)
            if three.max() > 10.0 * usual:  # a cloud that is wide at the start would hide all that follows
                axes.set_yscale("symlog", linthresh=2.0 * usual)
                axes.yaxis.set_major_locator(symmetric_ticks(usual, three.max()))
                axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
            axes.text(0.99, 0.03, f"{100.0 * share:.1f} % inside", transform=axes.transAxes, ha="right")
        rows[-1, 0].set(xlabel="time [s]")
        style.legend(rows[0, 0])
        return figure
    return draw


def apart(look, happened):
    """Times at which something happened, no more of them than can be told apart."""
    import numpy

    t = look["t"][happened]
    if len(t) == 0:
        return t
    width = (look["t"][-1] - look["t"][0]) / POINTS or 1.0
    return t[numpy.unique(((t - t[0]) / width).astype(int), return_index=True)[1]]


def spans(look, raised):
    """Begin and length of the times in which something holds, each until the step after its last."""
    import numpy

    t = look["t"]
    edges = numpy.flatnonzero(numpy.diff(numpy.concatenate([[0], raised.astype(int), [0]])))
    ends = numpy.append(t, t[-1] + (t[-1] - t[0]) / len(t))
    return [(t[begin], ends[end] - t[begin]) for begin, end in zip(edges[0::2], edges[1::2])]


def draw_ess(study):
    def draw(_):
        look = study.look
        figure, axes = style.new_figure()
        few = thin(look)
        axes.plot(look["t"][few], look["n"][few], color=style.MUTED, linewidth=0.9, linestyle=":", label="particles")
        axes.plot(look["t"][few], look["ess"][few], color=style.OURS, linewidth=1.0, label="effective")
        style.ticks(axes, apart(look, look["resampled"] > 0), 0.0, 0.05 * look["n"].max(), style.OTHER, "resampled")
        axes.set(xlabel="time [s]", ylabel="particles", ylim=(0.0, None))
        style.legend(axes, 3)
        return figure
    return draw


def draw_flags(study):
    """A row for each phase and flag that occurs; a mark wherever it does."""
    def draw(_):
        import numpy

        look = study.look
        names = live.names()
        said = [live.flags(step, names) for step in look.steps]
        rows = {f"phase {names['phase'][number]}": look["phase"] == number for number in sorted(set(look["phase"])) if number}
        for name in sorted({name for flags in said for name in flags}):
            rows[name] = numpy.array([name in flags for flags in said])
        rows["resampled"] = look["resampled"] > 0
        figure, axes = style.new_figure(1.1 + 0.27 * len(rows))
        for y, (name, raised) in enumerate(rows.items()):
            color = style.OTHER if name.startswith(("fault", "refused", "event")) else style.OURS
            if name == "resampled":
                style.ticks(axes, apart(look, raised), y - 0.3, y + 0.3, style.MUTED)
            else:
                axes.broken_barh(spans(look, raised), (y - 0.3, 0.6), color=color)
        axes.set(xlabel="time [s]", xlim=(look["t"][0], look["t"][-1]), ylim=(len(rows) - 0.4, -0.6))
        axes.set_yticks(range(len(rows)), [name.lower() for name in rows])
        axes.grid(visible=False, axis="y")
        if not any(name != "resampled" for name in rows):
            axes.set_title("no flag was raised in this run")
        return figure
    return draw


def instants(look):
    """The steps whose clouds are drawn: the first and the last that have one, the others in between, closer at the start."""
    have = [k for k, step in enumerate(look.steps) if "cloud" in step]
    last = len(have) - 1
    return [have[k] for k in sorted({round(last * (i / (INSTANTS - 1)) ** 1.5) for i in range(INSTANTS)})]


def draw_clouds(study):
    def draw(_):
        import numpy
        from matplotlib import pyplot

        look = study.look
        figure, all_axes = pyplot.subplots(2, INSTANTS // 2, figsize=(style.WIDTH_IN, 3.9))
        for axes, k in zip(all_axes.flat, instants(look)):
            cloud = numpy.array(look.steps[k]["cloud"]).reshape(-1, 2)
            style.dots(axes, cloud[:, 0], cloud[:, 1], style.OTHER, 1.6, 0.5, "particles")
            axes.plot(*look["estimate"][k], "o", color=style.OURS, markersize=4, label="estimate", linestyle="none")
            if len(known(look)) == 2:
                axes.plot(*look["truth"][k], "+", color=style.INK, markersize=8, label=look.against, linestyle="none")
            axes.set_title(f"{look['t'][k]:.4g} s", fontsize=9)
            axes.tick_params(labelsize=7)
            axes.locator_params(nbins=3)
            axes.set_aspect("equal", adjustable="datalim")
        for axes in list(all_axes.flat)[len(instants(look)):]:
            axes.set_visible(False)
        all_axes[1, 0].set(xlabel=look.axes[0], ylabel=look.axes[1])
        handles, labels = all_axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3)
        return figure
    return draw


def budgeted(scenario):
    """Instructions of a cycle on the emulated targets, as tools/budgets.json holds them: label -> mean and worst."""
    targets = json.loads((ROOT / "tools/budgets.json").read_text(encoding="utf-8"))["instructions"]
    return {f"{target}{name[len(scenario):]}, N = {n}": (line["mean"], line["worst"])
            for target, scenarios in targets.items() for name, counts in scenarios.items()
            if name.split(" ")[0] == scenario for n, line in counts.items()}


def draw_cycles(study):
    def draw(_):
        look = study.look
        bars = budgeted(study.scenario)
        figure, rows = style.new_figure(2.6 + 0.26 * len(bars) + (0.7 if bars else 0.0), rows=2 if bars else 1, squeeze=False,
                                        height_ratios=[2.0, 0.4 + 0.26 * len(bars)] if bars else [1.0])
        few, axes = thin(look), rows[0, 0]
        timed = look["us"][few] > 0.0
        axes.plot(look["t"][few][timed], look["us"][few][timed], color=style.OURS, linewidth=0.9, label="a cycle here")
        axes.axhline(study.timing["budget_us"], color=style.OTHER, linestyle="--", linewidth=1.2, label="budget")
        axes.set(xlabel="time [s]", ylabel="time [µs]", yscale="log")
        style.plain_log(axes.yaxis)
        style.legend(axes)
        if bars:
            low, y = rows[1, 0], range(len(bars))
            low.barh(y, [mean / 1e3 for mean, _ in bars.values()], 0.6, color=style.OURS)
            low.plot([worst / 1e3 for _, worst in bars.values()], y, "|", color=style.OTHER, markersize=9)
            low.set_yticks(y, bars, fontsize=8)
            low.set(xlabel="1000 instructions (not cycles)", xlim=(0.0, None))
            low.invert_yaxis()
            low.grid(visible=False, axis="y")
        return figure
    return draw


def topic(results, scenario):
    """None where no study of the scenario can be looked at."""
    study = shown(results, scenario)
    if study is None:
        return None
    once = f"Run 0 of {study.id}."
    figures = [
        Figure(f"{scenario}-bands", f"{scenario}: truth, estimate and three standard deviations", once, draw_bands(study)),
        Figure(f"{scenario}-inside", f"{scenario}: errors inside the bands",
               f"{once} The share counts the steps whose error is within three standard deviations.", draw_inside(study)),
        Figure(f"{scenario}-ess", f"{scenario}: effective sample size", f"{once} A tick where the filter resampled.",
               draw_ess(study)),
        Figure(f"{scenario}-flags", f"{scenario}: flags over time",
               f"{once} Phases are judged only where the filter has a watch.", draw_flags(study)),
        Figure(f"{scenario}-clouds", f"{scenario}: particles at chosen instants", f"{once} At most 200 particles each.",
               draw_clouds(study)),
        Figure(f"{scenario}-cycles", f"{scenario}: cost of a step against its budget",
               f"{once} Above: on the machine that made this page. Below, where tools/budgets.json has the scenario: emulated "
               "targets, mean and (mark) longest; the tests hold these counts to within 2 %.", draw_cycles(study)),
    ]
    if not known(study.look):
        figures = [figure for figure in figures if not figure.id.endswith("-inside")]
    return Topic(f"{scenario}-run", "One run, step by step", tuple(figures), lambda _: False)
