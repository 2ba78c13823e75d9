"""Figures of the drive in a street canyon: track, and error over time."""
import style
from topics import Figure, Topic

SCENARIO = "car"
FILTERS = {"mixture": ("one-sided mixture", style.OURS), "gaussian": ("Gaussian", style.OTHER),
           "odometry": ("odometry alone", style.THIRD)}


def draw_track(results):
    figure, axes = style.new_figure()
    truth = results.one(SCENARIO, filter="mixture").series
    axes.plot(truth["truth_x_m"], truth["truth_y_m"], color=style.INK, label="truth")
    for name, (label, color) in FILTERS.items():
        mean = results.one(SCENARIO, filter=name).series
        axes.plot(mean["x_m"], mean["y_m"], color=color, linewidth=1.1, label=label)
    axes.set(xlabel="east [m]", ylabel="north [m]")
    style.to_scale(figure, axes)
    style.legend(axes)
    return figure


def draw_error(results):
    figure, axes = style.new_figure()
    for name, (label, color) in FILTERS.items():
        mean = results.one(SCENARIO, filter=name).series
        axes.plot(mean["measured_t_s"], mean["error_m"], color=color, linewidth=1.1, label=label)
    axes.set(xlabel="time [s]", ylabel="horizontal error [m]", ylim=(0.0, None))
    style.legend(axes)
    return figure


TOPICS = (
    Topic("car", "Street canyon",
          (Figure("car-track", "Drive in a street canyon: track",
                  "Mean over the runs; odometry begins at the true start, the others at the first fix.", draw_track),
           Figure("car-error", "Drive in a street canyon: error over time", "Mean over the runs.", draw_error)),
          lambda study: True),
)
