"""Figures of the recorded fixed-wing flights: the wind that two filters find, and the yaw's offset."""
import style
from topics import Figure, Topic, with_settings

SCENARIO = "wind"
FLIGHTS = {"px4": "light wind, hand flying, then a loiter", "x8": "strong wind, aerobatics"}


def draw_wind(flight):
    def draw(results):
        figure, axes = style.new_figure(4.4, rows=2, sharex=True)
        for name, color, label in (("marginalised", style.OURS, "marginalised"), ("bootstrap", style.OTHER, "plain")):
            mean = results.one(SCENARIO, flight=flight, filter=name).series
            t = mean["measured_t_s"]
            for row, column in zip(axes, ("wind_x_mps", "wind_y_mps")):
                row.plot(t, mean[column], color=color, linewidth=1.2, label=label)
        axes[0].set(ylabel="wind to north [m/s]")
        axes[1].set(xlabel="time [s]", ylabel="wind to east [m/s]")
        style.legend(axes[0])
        return figure
    return draw


def draw_offset(flight):
    def draw(results):
        import numpy

        mean = results.one(SCENARIO, flight=flight, filter="marginalised").series
        figure, axes = style.new_figure(4.4, rows=2, sharex=True)
        axes[0].plot(mean["measured_t_s"], numpy.degrees(mean["offset_rad"]), color=style.OURS, linewidth=1.1)
        axes[0].set(ylabel="yaw offset [deg]")
        axes[1].plot(mean["measured_t_s"], mean["scale"], color=style.OURS, linewidth=1.1)
        axes[1].set(xlabel="time [s]", ylabel="airspeed scale")
        return figure
    return draw


TOPICS = tuple(
    Topic(f"wind-{flight}", what.capitalize(),
          (Figure(f"wind-wind-{flight}", f"Wind in flight, {what}",
                  "Mean over the runs, 300 particles each: the plain filter draws all eight states and settles on a wrong wind.",
                  draw_wind(flight)),
           Figure(f"wind-offset-{flight}", f"Yaw offset and airspeed scale, {what}", "Mean over the runs.",
                  draw_offset(flight))),
          with_settings(flight=flight))
    for flight, what in FLIGHTS.items())
