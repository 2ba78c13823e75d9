"""Figures of the recorded ranges: the track, the error over time, and how the errors are distributed."""
import style
from topics import Figure, Topic, with_settings

SCENARIO = "uwb-range"
SETS = {"los_a1": "outdoors, line of sight", "nlos_a2": "outdoors, obstructed", "indoor": "indoors, unknown start"}
COLORS = {"los_a1": style.OURS, "nlos_a2": style.OTHER, "indoor": style.THIRD}
SETTLING = {"indoor": 60}  # ranges that are not scored


def scored(name, column):
    return column[SETTLING.get(name, 0):]


def draw_track(name):
    def draw(results):
        run = results.one(SCENARIO, set=name).trace
        figure, axes = style.new_figure()
        x, y = (scored(name, run[column]) for column in ("x_m", "y_m"))
        axes.plot(scored(name, run["truth_x_m"]), scored(name, run["truth_y_m"]), color=style.INK, label="truth")
        axes.plot(x, y, color=style.OURS, linewidth=1.2, alpha=0.85, label="particle filter")
        axes.set(xlabel="x [m]", ylabel="y [m]")
        style.to_scale(figure, axes)
        style.legend(axes)
        return figure
    return draw


def draw_error(name):
    def draw(results):
        mean = results.one(SCENARIO, set=name).series
        figure, axes = style.new_figure(2.9)
        t = mean["measured_t_s"] - mean["measured_t_s"][0]
        axes.plot(t, mean["error_m"], color=style.OURS, linewidth=1.1)
        if name in SETTLING:
            axes.axvspan(0.0, t[SETTLING[name]], color=style.BAND, alpha=0.5, linewidth=0, label="not scored")
            style.legend(axes)
        axes.set(xlabel="time [s]", ylabel="horizontal error [m]", ylim=(0.0, None))
        return figure
    return draw


def draw_distribution(results):
    import numpy

    figure, axes = style.new_figure()
    for name, color in COLORS.items():
        error = numpy.sort(scored(name, results.one(SCENARIO, set=name).trace["error_m"]))
        share = (numpy.arange(len(error)) + 1.0) / len(error)
        axes.plot(error, share, color=color, label=SETS[name])
    axes.set(xscale="log", xlabel="horizontal error [m]", ylabel="share of errors below", ylim=(0.0, 1.0))
    axes.set_xlim(left=1e-2)
    style.plain_log(axes.xaxis)
    style.legend(axes)
    return figure


def set_topic(name):
    return Topic(
        f"uwb-range-{name.replace('_', '-')}", SETS[name].capitalize(),
        (Figure(f"uwb-range-track-{name}", f"UWB ranges, {SETS[name]}: track",
                "One run: estimate against truth.", draw_track(name)),
         Figure(f"uwb-range-error-{name}", f"UWB ranges, {SETS[name]}: error over time", "Mean over the runs.",
                draw_error(name))),
        with_settings(set=name))


TOPICS = (
    *(set_topic(name) for name in SETS),
    Topic("uwb-range-errors", "All recordings",
          (Figure("uwb-range-cdf", "UWB ranges: distribution of the errors",
                  "One run of each recording, one error a range.", draw_distribution),),
          lambda study: False),
)
