"""Figures of the UAV in the wind: clouds with and without resampling, forecasts, the wind, the waypoint replay."""
import math

import style
from data import NotDrawn
from topics import Figure, Topic, with_settings

SCENARIO = "uav-trajectory"
MAGNIFIED = 8.0  # deviations of the clouds, which are metres on a kilometre of track
WINDS = ("north", "east", "west", "south")
WIND_NAMES = {"north": "[0, 1]", "east": "[1, 0]", "west": "[-1, 0]", "south": "[0, -1]"}


def plain(results, sim, **settings):
    return results.one(SCENARIO, sim=sim, **{"filter": "pf", "resampling": "on", "kc": "auto", "wind": "auto",
                                             "kernel": "auto", **settings})


def magnified_cloud(study, name, t):
    """The cloud of a time, its deviations from the nominal position enlarged."""
    run = study.trace
    cloud = study.cloud
    row = run["t_s"] == t
    mine = (cloud["set"] == name) & (cloud["t_s"] == t)
    nominal = [run[column][row][0] for column in ("nominal_x_m", "nominal_y_m")]
    return [center + MAGNIFIED * (cloud[axis][mine] - center) for axis, center in zip("xy", nominal)]


def draw_clouds(axes, study, name, times, color):
    if name not in set(study.cloud["set"]):
        raise NotDrawn(f"{study.id} has no clouds of the set {name}")
    run = study.trace
    axes.plot(run["nominal_x_m"], run["nominal_y_m"], color=style.INK, linewidth=1.0, label="nominal")
    for i, t in enumerate(times):
        x, y = magnified_cloud(study, name, t)
        style.dots(axes, x[::2], y[::2], color, 1.5, 0.6, "particles" if i == 0 else None)


def draw_circle(name):
    def draw(results):
        figure, axes = style.new_figure()
        study = plain(results, "circle")
        draw_clouds(axes, study, name, range(5, 61, 5), style.OURS if name == "filter" else style.OTHER)
        axes.set(xlabel="x [m]", ylabel="y [m]", xlim=(-300, 300), ylim=(-300, 340))
        style.to_scale(figure, axes)
        style.legend(axes)
        return figure
    return draw


def draw_line(results):
    figure, both = style.new_figure(3.6, rows=2, sharex=True, sharey=True)
    study = plain(results, "line")
    for axes, name, color, title in ((both[0], "unresampled", style.OTHER, "without resampling"),
                                     (both[1], "filter", style.OURS, "with resampling")):
        draw_clouds(axes, study, name, range(5, 61, 5), color)
        axes.set(ylabel="y [m]", title=title)
    both[1].set(xlabel="x [m]")
    return figure


def draw_spread(results):
    mean = plain(results, "circle").series
    figure, axes = style.new_figure()
    axes.plot(mean["t_s"], mean["cloud_std_unresampled_m"], color=style.OTHER, label="without resampling")
    axes.plot(mean["t_s"], mean["cloud_std_m"], color=style.OURS, label="with resampling")
    axes.set(xlabel="time [s]", ylabel="standard deviation per axis [m]", ylim=(0.0, None))
    style.legend(axes)
    return figure


def draw_table(results):
    metrics = plain(results, "winds").metric
    figure, all_axes = style.new_figure(4.8, rows=3, sharex=True)
    for axes, what, name in zip(all_axes, ("mean", "max", "std"), ("mean [m]", "maximum [m]", "std [m]")):
        for shift, field, color, label in ((-0.19, "mean", style.OURS, "ours"), (0.19, "paper", style.THIRD, "paper")):
            values = [metrics(f"{what}_{wind}_m")[field] for wind in WINDS]
            if None in values:
                raise NotDrawn(f"{what}: the paper's figures are not in the summary")
            x = [i + shift for i in range(len(WINDS))]
            drawn = axes.bar(x, values, 0.34, color=color, label=label)
            axes.bar_label(drawn, fmt="%.2f", fontsize=8, padding=1)
            if field == "mean":
                errors = [metrics(f"{what}_{wind}_m")["stderr"] or 0.0 for wind in WINDS]
                axes.errorbar(x, values, errors, fmt="none", ecolor=style.INK, elinewidth=1)
        axes.set(ylabel=name, xticks=range(len(WINDS)), xticklabels=[WIND_NAMES[wind] for wind in WINDS])
        axes.margins(y=0.22)
        axes.grid(visible=False, axis="x")
    all_axes[-1].set(xlabel="wind [m/s]")
    style.legend(all_axes[0])
    return figure


def draw_forecast(results):
    """Deviations from the nominal path, enlarged, of all that is drawn."""
    import numpy

    study = plain(results, "forecast")
    run = study.trace
    cloud = study.cloud
    nominal = numpy.column_stack([run["nominal_x_m"], run["nominal_y_m"]])

    def magnified(rows, x, y):
        return (nominal[rows] + MAGNIFIED * (numpy.column_stack([x, y]) - nominal[rows])).T

    figure, axes = style.new_figure()
    axes.plot(*nominal.T, color=style.MUTED, linewidth=0.8, linestyle=":", label="nominal")
    ahead = cloud["set"] == "ahead"
    rows = numpy.searchsorted(run["t_s"], cloud["t_s"][ahead])
    style.dots(axes, *magnified(rows, cloud["x"][ahead], cloud["y"][ahead]), style.OURS, 1.5, 0.5, "particles")
    every = numpy.arange(len(nominal))
    axes.plot(*magnified(every, run["truth_x_m"], run["truth_y_m"]), color=style.INK, linewidth=1.1, label="truth")
    axes.plot(*magnified(every, run["estimate_x_m"], run["estimate_y_m"]), color=style.OTHER, linewidth=1.3,
              label="estimate")
    axes.plot(*magnified(every, run["ahead_x_m"], run["ahead_y_m"]), color=style.OURS, linewidth=1.3, label="forecast")
    style.dots(axes, *magnified(every, run["fix_x_m"], run["fix_y_m"]), style.FOURTH, 4.0, 1.0, "fixes")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    style.to_scale(figure, axes)
    style.legend(axes, 3)
    return figure


def draw_forecast_error(results):
    figure, axes = style.new_figure()
    study = plain(results, "forecast")
    mean = study.series
    coverage = study.metric("coverage")["mean"]
    axes.plot(mean["t_s"], mean["ahead_error_m"], color=style.OURS, label="error of the forecast")
    axes.plot(mean["t_s"], (math.pi / 2.0) ** 0.5 * mean["ahead_std_m"], color=style.OURS, linestyle="--",
              label="expected from its spread")
    axes.plot(mean["t_s"], mean["error_m"], color=style.OTHER, label="error of the filter")
    axes.set(xlabel="time [s]", ylabel="mean error [m]", ylim=(0.0, None))
    axes.text(0.99, 0.05, f"coverage at 60 s: {100.0 * coverage:.1f} %", transform=axes.transAxes, ha="right")
    style.legend(axes)
    return figure


def draw_wind(results):
    import numpy

    run = plain(results, "wind").trace
    truth = (0.0, 1.0)  # the page's for this simulation; the trace must agree
    error = numpy.hypot(run["wind_x_mps"] - truth[0], run["wind_y_mps"] - truth[1])
    both = numpy.isfinite(error) & numpy.isfinite(run["wind_error_mps"])
    if not both.any() or not numpy.allclose(error[both], run["wind_error_mps"][both], atol=1e-4):
        raise NotDrawn("the truth's wind is not the page's [0, 1] m/s")
    figure, axes = style.new_figure()
    for axis, value, color in (("x", truth[0], style.OTHER), ("y", truth[1], style.OURS)):
        axes.plot(run["t_s"], run[f"wind_{axis}_mps"], color=color, label=f"wind along {axis}")
        axes.axhline(value, color=color, linestyle="--", linewidth=1.0)
    axes.set(xlabel="time [s]", ylabel="wind [m/s], dashed: truth", xlim=(0.0, run["t_s"][both].max()))
    style.legend(axes)
    return figure


def draw_wind_error(results):
    figure, axes = style.new_figure()
    lines = ((dict(), style.OURS, "with kernel step"), (dict(kernel="off"), style.THIRD, "without"),
             (dict(filter="ekf"), style.OTHER, "extended KF"))
    for settings, color, name in lines:
        mean = plain(results, "wind", **settings).series
        axes.plot(mean["t_s"], mean["wind_error_mps"], color=color, label=name)
    axes.set(xlabel="time [s]", ylabel="error of the wind [m/s]", yscale="log")
    style.plain_log(axes.yaxis)
    style.legend(axes, 3)
    return figure


def draw_wind_forecast(results):
    mean = plain(results, "wind").series
    figure, axes = style.new_figure()
    axes.plot(mean["t_s"], mean["ahead_ignored_error_m"], color=style.OTHER, label="wind ignored")
    axes.plot(mean["t_s"], mean["ahead_error_m"], color=style.OURS, label="wind inferred")
    axes.plot(mean["t_s"], mean["ahead_std_m"], color=style.OURS, linestyle="--", label="its standard deviation")
    axes.set(xlabel="time [s]", ylabel="error of the forecast [m]", ylim=(0.0, None), xlim=(30.0, 60.0))
    style.legend(axes)
    return figure


def draw_replay(results):
    import numpy

    run = plain(results, "replay").trace
    figure, axes = style.new_figure()
    axes.plot(run["truth_x_m"], run["truth_y_m"], color=style.INK, label="truth")
    begun = run["ahead_begun_s"]
    for i, begin in enumerate(numpy.unique(begun[numpy.isfinite(begun)])):
        mine = begun == begin
        for kind, color, name in (("ahead_ignored", style.OTHER, "forecast, wind ignored"),
                                  ("ahead", style.OURS, "forecast, wind inferred")):
            axes.plot(run[f"{kind}_x_m"][mine], run[f"{kind}_y_m"][mine], color=color, linewidth=1.4,
                      label=name if i == 0 else None)
    axes.plot([400, 400, 0, 0], [0, 400, 400, 0], linestyle="none", marker="s", markersize=5, color=style.MUTED,
              label="waypoints")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    style.to_scale(figure, axes)
    style.legend(axes)
    return figure


CLOUDS = f"One run. The deviations of the particles are drawn {MAGNIFIED:g} times as large as they are, every 5 s."

TOPICS = (
    Topic("uav-trajectory-line", "Simulation 1: straight line",
          (Figure("uav-trajectory-clouds-line", "UAV on a line: clouds around the nominal trajectory", CLOUDS,
                  draw_line),),
          with_settings(sim="line")),
    Topic("uav-trajectory-circle", "Simulation 2: circle",
          (Figure("uav-trajectory-clouds-circle-off", "UAV on a circle: clouds without resampling", CLOUDS,
                  draw_circle("unresampled")),
           Figure("uav-trajectory-clouds-circle-on", "UAV on a circle: clouds with resampling", CLOUDS,
                  draw_circle("filter")),
           Figure("uav-trajectory-spread", "UAV on a circle: spread of the cloud over time",
                  "Mean over the runs. Without resampling the cloud keeps growing; each fix cuts it with resampling.",
                  draw_spread)),
          with_settings(sim="circle")),
    Topic("uav-trajectory-winds", "The four winds of the paper's Table 1",
          (Figure("uav-trajectory-winds", "UAV: Table 1, ours and the paper's",
                  "Distance of the particles from the truth. The bars' lines are our standard errors.", draw_table),),
          with_settings(sim="winds")),
    Topic("uav-trajectory-forecast", "Forecast",
          (Figure("uav-trajectory-forecast", "UAV: forecast from 30 s to 60 s",
                  f"One run. Deviations from the nominal path are drawn {MAGNIFIED:g} times as large as they are.",
                  draw_forecast),
           Figure("uav-trajectory-forecast-error", "UAV: error of the forecast and its coverage",
                  "Mean over the runs. Dashed: the mean error that a Gaussian cloud of that spread would have.",
                  draw_forecast_error)),
          with_settings(sim="forecast")),
    Topic("uav-trajectory-wind", "Wind unknown",
          (Figure("uav-trajectory-wind", "UAV: the wind inferred", "One run.", draw_wind),
           Figure("uav-trajectory-wind-error", "UAV: error of the inferred wind", "Mean over the runs.",
                  draw_wind_error),
           Figure("uav-trajectory-wind-forecast", "UAV: forecasts with the wind inferred and ignored",
                  "Mean over the runs.", draw_wind_forecast)),
          with_settings(sim="wind")),
    Topic("uav-trajectory-replay", "Waypoint replay",
          (Figure("uav-trajectory-replay", "UAV: waypoint replay with forecasts of 30 s", "One run.", draw_replay),),
          with_settings(sim="replay")),
)
