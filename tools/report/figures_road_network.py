"""Figures of the standoff on a network of streets: one flight's tracks, and the errors over time of all."""
import style
from topics import Figure, Topic

SCENARIO = "road-network"
OUTAGES = ((20.0, 30.0), (45.0, 55.0))
FILTERS = {"annulus": ("annulus", style.OTHER), "two": ("streets, two models", style.OURS)}
RINGS_M = (70.0, 130.0)


def draw_streets(axes):
    import numpy

    turns = 2.0 * numpy.pi * numpy.arange(17) / 16.0
    for radius in RINGS_M:
        axes.plot(radius * numpy.cos(turns), radius * numpy.sin(turns), color=style.BAND, linewidth=3.0, zorder=0)
    for turn in turns[:-1:2]:
        axes.plot([radius * numpy.cos(turn) for radius in RINGS_M], [radius * numpy.sin(turn) for radius in RINGS_M],
                  color=style.BAND, linewidth=3.0, zorder=0)


def draw_track(results):
    run = results.one(SCENARIO).trace
    figure, axes = style.new_figure()
    draw_streets(axes)
    axes.plot(run["truth_x_m"], run["truth_y_m"], color=style.INK, label="target")
    for name, (label, color) in FILTERS.items():
        axes.plot(run[f"{name}_x_m"], run[f"{name}_y_m"], color=color, linewidth=1.1, label=label)
    axes.plot(run["uav_x_m"], run["uav_y_m"], color=style.THIRD, linewidth=0.7, label="UAV, by the latter")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    style.to_scale(figure, axes)
    style.legend(axes)
    return figure


def draw_error(results):
    mean = results.one(SCENARIO).series
    figure, axes = style.new_figure()
    for begin, end in OUTAGES:
        axes.axvspan(begin, end, color=style.BAND, linewidth=0)
    for name, (label, color) in FILTERS.items():
        axes.plot(mean["t_s"], mean[f"error_{name}_m"], color=color, linewidth=1.2, label=label)
    axes.set(xlabel="time [s]", ylabel="position error [m]", ylim=(0.0, None))
    style.legend(axes)
    return figure


TOPICS = (
    Topic("road-network", "Car or lorry on streets",
          (Figure("road-network-track", "Standoff on a network of streets: one flight",
                  "Both filters see the target but in the two outages; each has its own UAV.", draw_track),
           Figure("road-network-error", "Standoff on a network of streets: error over time",
                  "Mean over the runs; the target is not seen in the shaded times.", draw_error)),
          lambda study: True),
)
