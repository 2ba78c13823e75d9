"""Figures of the GPS position: measurements, Kalman filter and particle filter against the truth."""
import style
from topics import Figure, Topic, with_settings

SCENARIO = "gps"


def study(results, variant, filter_, **settings):
    return results.one(SCENARIO, variant=variant, filter=filter_, **{"noise": "coloured", **settings})


def draw_line(results):
    figure, axes = style.new_figure()
    run = study(results, "line", "pf-coloured").trace
    document = study(results, "line", "kf").trace
    style.dots(axes, run["t_s"], run["measured_north_m"], style.MEASURED, 3.0, 0.9, "GPS")
    axes.plot(run["t_s"], run["truth_north_m"], color=style.INK, label="truth")
    axes.plot(document["t_s"], document["north_m"], color=style.OTHER, label="Kalman filter")
    axes.plot(run["t_s"], run["north_m"], color=style.OURS, label="particle filter, coloured")
    axes.set(xlabel="time [s]", ylabel="north [m]")
    style.legend(axes)
    return figure


def draw_error(variant, lines, **options):
    def draw(results):
        figure, axes = style.new_figure()
        first = study(results, variant, lines[0][0]).series
        axes.plot(first["t_s"], first["error_measured_m"], color=style.MEASURED, linewidth=1.1,
                  label="radar" if variant.startswith("radar") else "GPS")
        for filter_, color, name in lines:
            mean = study(results, variant, filter_).series
            axes.plot(mean["t_s"], mean["error_m"], color=color, label=name)
        axes.set(xlabel="time [s]", ylabel="position error [m]", **options)
        if options.get("yscale") == "log":
            style.plain_log(axes.yaxis)
        else:
            axes.set_ylim(bottom=0.0)
        style.legend(axes)
        return figure
    return draw


def draw_track(variant, filter_, name, beside=()):
    def draw(results):
        run = study(results, variant, filter_).trace
        figure, axes = style.new_figure()
        style.dots(axes, run["measured_east_m"], run["measured_north_m"], style.MEASURED, 2.2, 0.7,
                   "radar" if variant.startswith("radar") else "GPS")
        axes.plot(run["truth_east_m"], run["truth_north_m"], color=style.INK, label="truth")
        for other, color, label in beside:
            track = study(results, variant, other).trace
            axes.plot(track["east_m"], track["north_m"], color=color, linewidth=1.2, label=label)
        axes.plot(run["east_m"], run["north_m"], color=style.OURS, linewidth=1.3, label=name)
        axes.set(xlabel="east [m]", ylabel="north [m]")
        style.to_scale(figure, axes)
        style.legend(axes)
        return figure
    return draw


LINE = (("kf", style.OTHER, "Kalman filter"), ("pf", style.THIRD, "PF, same model"),
        ("pf-coloured", style.OURS, "PF, coloured"))
CURVE = (("kf", style.OTHER, "Kalman filter"), ("pf", style.THIRD, "PF, white model"),
         ("pf-coloured", style.OURS, "PF, coloured"))
RADAR = (("ekf", style.OTHER, "extended KF"), ("pf", style.OURS, "particle filter"))

TOPICS = (
    Topic("gps-line", "Straight line, the document's scenario",
          (Figure("gps-line", "GPS, line: Kalman filter and particle filter against the truth", "One run.", draw_line),
           Figure("gps-line-error", "GPS, line: error over time", "Mean over the runs.", draw_error("line", LINE))),
          with_settings(variant="line")),
    Topic("gps-curve", "Path with turns",
          (Figure("gps-curve", "GPS, curve: particle filter against the truth",
                  "One run. The document's Kalman filter knows straight lines only.",
                  draw_track("curve", "pf-coloured", "particle filter", (("kf", style.OTHER, "Kalman filter"),))),
           Figure("gps-curve-error", "GPS, curve: error over time", "Mean over the runs.",
                  draw_error("curve", CURVE, yscale="log"))),
          with_settings(variant="curve")),
    Topic("gps-radar", "Radar",
          (Figure("gps-radar", "Radar: particle filter against the truth", "One run.",
                  draw_track("radar", "pf", "particle filter")),
           Figure("gps-radar-error", "Radar: error over time", "Mean over the runs.", draw_error("radar", RADAR))),
          with_settings(variant="radar")),
    Topic("gps-radar-coarse", "Radar with a coarse azimuth",
          (Figure("gps-radar-coarse", "Coarse radar: particle filter against the truth", "One run.",
                  draw_track("radar-coarse", "pf", "particle filter")),
           Figure("gps-radar-coarse-error", "Coarse radar: error over time", "Mean over the runs.",
                  draw_error("radar-coarse", RADAR))),
          with_settings(variant="radar-coarse")),
)
