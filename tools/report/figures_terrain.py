"""Figures of navigation by the ground below: how the error falls, filter by filter, and the cloud on its way."""
import style
from topics import Figure, Topic, with_settings

SCENARIO = "terrain"
FILTERS = {"rb": ("marginalised", style.OURS), "regularised": ("regularised", style.THIRD),
           "tempered": ("tempered", style.FOURTH), "plain": ("plain", style.OTHER)}


def draw_error(flight):
    def draw(results):
        figure, axes = style.new_figure()
        for name, (label, color) in FILTERS.items():
            study = results.one(SCENARIO, filter=name, flight=flight, adapt="off")
            mean = study.series
            axes.plot(mean["measured_t_s"], mean["error_m"], color=color, linewidth=1.2,
                      label=f"{label}, N = {study.settings['particles']}")
        axes.axhline(60.0, color=style.MUTED, linewidth=0.7, linestyle=":")
        axes.axvline(200.0, color=style.MUTED, linewidth=0.7, linestyle=":")
        axes.set(yscale="log", xlabel="time [s]", ylabel="horizontal error [m]")
        style.plain_log(axes.yaxis)
        style.legend(axes)
        return figure
    return draw


def draw_track(flight):
    def draw(results):
        study = results.one(SCENARIO, filter="rb", flight=flight, adapt="off")
        run, cloud = study.trace, study.cloud
        figure, axes = style.new_figure()
        axes.plot(run["truth_x_m"] / 1e3, run["truth_y_m"] / 1e3, color=style.INK, label="truth")
        axes.plot(run["x_m"] / 1e3, run["y_m"] / 1e3, color=style.OURS, linewidth=1.2, alpha=0.85, label="estimate")
        early = cloud["t_s"] <= 100.0
        style.dots(axes, cloud["x"][early] / 1e3, cloud["y"][early] / 1e3, style.MUTED, 0.8, 0.6, "particles, to 100 s")
        axes.set(xlabel="east [km]", ylabel="north [km]")
        style.to_scale(figure, axes)
        style.legend(axes)
        return figure
    return draw


def flight_topic(flight):
    return Topic(
        f"terrain-{flight}", f"Flight {flight}",
        (Figure(f"terrain-error-{flight}", f"Terrain, flight {flight}: error over time",
                "Mean over the runs: a filter that is lost in some of them stays high. Dotted: within 60 m from 200 s on.",
                draw_error(flight)),
         Figure(f"terrain-track-{flight}", f"Terrain, flight {flight}: track", "One run of the marginalised filter.",
                draw_track(flight))),
        with_settings(flight=flight))


TOPICS = (flight_topic("1"), flight_topic("2"))
