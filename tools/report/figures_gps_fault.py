"""Figures of the flight through a GPS fault: heights, and the track with what the receiver said."""
import style
from topics import Figure, Topic

SCENARIO = "gps-fault"


def draw_height(results):
    figure, axes = style.new_figure()
    gated = results.one(SCENARIO, filter="gated").series
    plain = results.one(SCENARIO, filter="ungated").series
    t = gated["measured_t_s"]
    style.dots(axes, t, gated["gps_height_m"], style.MEASURED, label="GPS less its usual offset")
    axes.plot(t, gated["barometer_m"], color=style.INK, linewidth=0.8, label="barometer")
    axes.plot(t, plain["height_m"], color=style.OTHER, linewidth=1.0, label="without a gate")
    axes.plot(t, gated["height_m"], color=style.OURS, linewidth=1.1, label="with the gate")
    axes.set(xlabel="time [s]", ylabel="height [m]", ylim=(-30.0, 30.0))
    style.legend(axes)
    return figure


def draw_flag(results):
    figure, axes = style.new_figure(4.4, rows=2, sharex=True)
    gated = results.one(SCENARIO, filter="gated").series
    axes[0].plot(gated["measured_t_s"], gated["flag"], color=style.OURS, linewidth=1.1)
    axes[0].set(ylabel="GPS flagged")
    axes[1].plot(gated["measured_t_s"], gated["sigma_m"], color=style.OURS, linewidth=1.1)
    axes[1].set(xlabel="time [s]", ylabel="position sigma [m]", ylim=(0.0, None))
    return figure


TOPICS = (
    Topic("gps-fault", "Through the fault",
          (Figure("gps-fault-height", "Height through a GPS fault", "Mean over the runs.", draw_height),
           Figure("gps-fault-flag", "The flag, and what is known of the place",
                  "Share of the runs that flag the GPS; standard deviation of the position, both axes together.",
                  draw_flag)),
          lambda study: True),
)
