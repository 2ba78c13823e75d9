"""Figures of the land vehicle: the route, the error over time, and the error index against the paper's."""
import style
from topics import Figure, Topic, with_settings

SCENARIO = "land-vehicle"
CASES = (1, 2, 3)
NOISES = {1: "noises 5 and 10", 2: "noises 10 and 15", 3: "noises 15 and 20"}


def known(results, filter_, case):
    return results.one(SCENARIO, filter=filter_, case=case, start="known", reading="variance", ukf="tuned")


def draw_paths(axes, run, scale):
    style.dots(axes, run["measured_east_m"], run["measured_north_m"], style.MEASURED, 2.0 * scale, 0.8, "measured")
    axes.plot(run["truth_east_m"], run["truth_north_m"], color=style.INK, linewidth=1.2 * scale, label="truth")
    axes.plot(run["estimate_east_m"], run["estimate_north_m"], color=style.OURS, linewidth=1.2 * scale,
              label="particle filter")


def enlarge(axes, run):
    """A part of the route, as an inset."""
    inset = axes.inset_axes((0.56, 0.52, 0.44, 0.48))
    draw_paths(inset, run, 1.2)
    k = len(run["t_s"]) // 2
    for set_limits, column in ((inset.set_xlim, "truth_east_m"), (inset.set_ylim, "truth_north_m")):
        set_limits(run[column][k] - 18.0, run[column][k] + 18.0)
    inset.set(xticks=[], yticks=[])
    inset.spines[["top", "right"]].set_visible(True)
    axes.indicate_inset_zoom(inset, edgecolor=style.MUTED)


def draw_route(case):
    def draw(results):
        run = known(results, "pf", case).trace
        figure, axes = style.new_figure()
        draw_paths(axes, run, 1.0)
        axes.set(xlabel="east [m]", ylabel="north [m]", xlim=(-60, 330))
        enlarge(axes, run)
        style.to_scale(figure, axes)
        style.legend(axes, 3)
        return figure
    return draw


def draw_error(case):
    def draw(results):
        figure, axes = style.new_figure()
        for filter_, color, name in (("ukf", style.OTHER, "unscented KF"), ("pf", style.OURS, "particle filter")):
            study = known(results, filter_, case)
            mean = study.series
            axes.plot(mean["t_s"], mean["eps_k"], color=color, label=name)
        axes.set(xlabel="time [s]", ylabel="error index of the step", ylim=(0.0, None))
        style.legend(axes)
        return figure
    return draw


def draw_eta(results):
    figure, axes = style.new_figure(3.6)
    bars = (("pf", "mean", style.OURS, "PF, ours"), ("pf", "paper", style.THIRD, "PF, paper"),
            ("ukf", "mean", style.OTHER, "UKF, ours"), ("ukf", "paper", style.FOURTH, "UKF, paper"))
    for i, (filter_, what, color, name) in enumerate(bars):
        metrics = [known(results, filter_, case).metric("eta") for case in CASES]
        x = [case + 0.2 * (i - 1.5) for case in CASES]
        drawn = axes.bar(x, [metric[what] for metric in metrics], 0.18, color=color, label=name)
        axes.bar_label(drawn, fmt="%.2f", fontsize=7.5, padding=2)
        if what == "mean":
            errors = [metric["stderr"] or 0.0 for metric in metrics]
            axes.errorbar(x, [metric["mean"] for metric in metrics], errors, fmt="none", ecolor=style.INK, elinewidth=1)
    axes.set(xticks=CASES, xticklabels=[f"case {case}" for case in CASES], ylabel="eta")
    axes.grid(visible=False, axis="x")
    style.legend(axes)
    return figure


def draw_uncertain(results):
    figure, axes = style.new_figure()
    for jitter, color in (("off", style.OTHER), ("on", style.OURS)):
        mean = results.one(SCENARIO, filter="pf", start="uncertain", jitter=jitter).series
        axes.plot(mean["t_s"], mean["eps_k"], color=color, label=f"PF, jitter {jitter}")
    axes.set(xlabel="time [s]", ylabel="error index of the step", ylim=(0.0, None))
    style.legend(axes)
    return figure


def case_topic(case):
    return Topic(
        f"land-vehicle-case-{case}", f"Case {case}: {NOISES[case]}",
        (Figure(f"land-vehicle-route-{case}", f"Land vehicle, case {case}: route",
                "One run: the estimate against the truth and the measured positions.", draw_route(case)),
         Figure(f"land-vehicle-error-{case}", f"Land vehicle, case {case}: error over time",
                "Mean over the runs. A tuned unscented Kalman filter is the exact optimum here, the particle filter "
                "lies just above it.", draw_error(case))),
        with_settings(case=case, start="known", ukf="tuned"))


TOPICS = (
    Topic("land-vehicle-index", "The error index against the paper's",
          (Figure("land-vehicle-eta", "Land vehicle: error index eta, ours and the paper's",
                  "The paper's particle filter is reproduced; its unscented Kalman filter is not: tuned, that filter "
                  "equals the exact one.", draw_eta),),
          with_settings(ukf="q-zero-p-zero")),
    *(case_topic(case) for case in CASES),
    Topic("land-vehicle-uncertain", "Uncertain start",
          (Figure("land-vehicle-uncertain", "Land vehicle, uncertain start: error over time",
                  "Mean over the runs, which a few lost runs dominate; the tables have the median.",
                  draw_uncertain),),
          with_settings(start="uncertain")),
)
