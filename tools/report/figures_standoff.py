"""Figures of the standoff tracking: orbits, vector field, errors over time, the standoff distance and the phase."""
import style
from data import NotDrawn
from topics import Figure, Topic

SCENARIO = "standoff"
PAGE = {"visibility": "inout", "plant": "zoh", "truth": "paper", "motion": "cv", "particles": 200, "tries": 4,
        "fallback": "slide"}
OUTAGES = ((20.0, 30.0), (45.0, 55.0))
INNER_M, OUTER_M = 96.0, 100.0
LAWS = (("lvfg", style.OURS, "LVFG"), ("nmpc", style.OTHER, "NMPC"), ("lvfg+", style.THIRD, "LVFG+"),
        ("nmpc+", style.FOURTH, "NMPC+"))


def page_study(results, filter_, guidance="lvfg", **settings):
    return results.one(SCENARIO, **{**PAGE, "filter": filter_, "guidance": guidance, **settings})


def draw_road(axes):
    from matplotlib.patches import Annulus

    axes.add_patch(Annulus((0.0, 0.0), OUTER_M, OUTER_M - INNER_M, facecolor=style.BAND, label="road"))


def draw_orbits(guidance):
    def draw(results):
        run = page_study(results, "cpf-multi", guidance).trace
        figure, axes = style.new_figure()
        draw_road(axes)
        axes.plot(run["uav1_x_m"], run["uav1_y_m"], color=style.OURS, linewidth=1.1, label="UAV 1")
        axes.plot(run["uav2_x_m"], run["uav2_y_m"], color=style.OTHER, linewidth=1.1, label="UAV 2")
        style.dots(axes, run["estimate_x_m"], run["estimate_y_m"], style.THIRD, 2.6, 0.9, "estimate")
        axes.plot(run["target_x_m"], run["target_y_m"], color=style.INK, linewidth=1.4, label="target")
        axes.set(xlabel="x [m]", ylabel="y [m]")
        style.to_scale(figure, axes)
        style.legend(axes, 3)
        return figure
    return draw


def draw_field(results):
    import numpy

    run = page_study(results, "cpf-multi").trace
    k = int(numpy.argmin(abs(run["t_s"] - 15.0)))
    radius = run["distance_wanted_m"][k]
    center = run["estimate_x_m"][k], run["estimate_y_m"][k]
    x, y = numpy.meshgrid(*(c + numpy.linspace(-2.2, 2.2, 17) * radius for c in center))
    dx, dy = x - center[0], y - center[1]
    heading = numpy.arctan2(dy, dx) + 2.0 * numpy.arctan(numpy.hypot(dx, dy) / radius)
    figure, axes = style.new_figure()
    axes.quiver(x, y, numpy.cos(heading), numpy.sin(heading), color=style.MUTED, scale=26, width=0.004)
    angle = numpy.linspace(0.0, 2.0 * numpy.pi, 100)
    axes.plot(center[0] + radius * numpy.cos(angle), center[1] + radius * numpy.sin(angle), color=style.INK,
              linewidth=1.0, linestyle="--", label="standoff orbit")
    span = (run["t_s"] > run["t_s"][k] - 8.0) & (run["t_s"] <= run["t_s"][k])
    for i, color in ((1, style.OURS), (2, style.OTHER)):
        axes.plot(run[f"uav{i}_x_m"][span] - run["estimate_x_m"][span] + center[0],
                  run[f"uav{i}_y_m"][span] - run["estimate_y_m"][span] + center[1], color=color, label=f"UAV {i}")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    style.to_scale(figure, axes)
    style.legend(axes, 3)
    return figure


def draw_error(column, label):
    def draw(results):
        figure, axes = style.new_figure()
        style.outages(axes, OUTAGES, None)
        for filter_, color, name in (("pf", style.OTHER, "PF"), ("cpf", style.THIRD, "CPF"),
                                     ("cpf-multi", style.OURS, "CPF, two UAVs"),
                                     ("ekf-multi", style.FOURTH, "EKF, two UAVs")):
            mean = page_study(results, filter_).series
            axes.plot(mean["t_s"], mean[column], color=color, label=name)
        axes.set(xlabel="time [s]", ylabel=label, ylim=(0.0, None))
        style.legend(axes)
        return figure
    return draw


def draw_distance(results):
    import numpy

    run = page_study(results, "cpf-multi").trace
    figure, axes = style.new_figure()
    style.outages(axes, OUTAGES, None)
    for i, color in ((1, style.OURS), (2, style.OTHER)):
        distance = numpy.hypot(run[f"uav{i}_x_m"] - run["target_x_m"], run[f"uav{i}_y_m"] - run["target_y_m"])
        axes.plot(run["t_s"], distance, color=color, linewidth=1.3, label=f"UAV {i} to target")
    axes.plot(run["t_s"], run["distance_wanted_m"], color=style.INK, linestyle="--", label="wanted")
    axes.set(xlabel="time [s]", ylabel="distance [m]", ylim=(0.0, None))
    style.legend(axes)
    return figure


def draw_particles(results):
    """The paper's Figure 5."""
    figure, axes = style.new_figure()
    for filter_, color, name in (("cpf", style.OTHER, "one UAV"), ("cpf-multi", style.OURS, "two UAVs")):
        wanted = {key: value for key, value in PAGE.items() if key != "particles"}
        studies = sorted(results.of(SCENARIO, filter=filter_, guidance="lvfg", **wanted),
                         key=lambda study: study.settings["particles"])
        if len({study.settings["particles"] for study in studies}) < 3:
            raise NotDrawn(f"tools/run made {filter_} with fewer than three numbers of particles")
        metrics = [study.metric("mean_rd_out_m") for study in studies]
        axes.errorbar([study.settings["particles"] for study in studies], [metric["mean"] for metric in metrics],
                      [metric["stderr"] or 0.0 for metric in metrics], color=color, marker="o", markersize=4,
                      label=f"{name}, ours")
        reference = [metric.get("reference") for metric in metrics]
        if None not in reference:
            axes.plot([study.settings["particles"] for study in studies], reference, color=color, linestyle="none",
                      marker="x", markersize=6, label=f"{name}, reference")
    axes.set(xscale="log", xlabel="particles", ylabel="wanted distance in the outages [m]")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_xticks([study.settings["particles"] for study in studies], minor=False)
    axes.set_xticks([], minor=True)
    style.legend(axes)
    return figure


def draw_law(column, label):
    def draw(results):
        figure, axes = style.new_figure()
        style.outages(axes, OUTAGES, None)
        for guidance, color, name in LAWS:
            mean = page_study(results, "cpf-multi", guidance).series
            axes.plot(mean["t_s"], mean[column], color=color, label=name)
        axes.set(xlabel="time [s]", ylabel=label, ylim=(0.0, None))
        style.legend(axes, 4)
        return figure
    return draw


GREY = "Grey: the target is not seen."

TOPICS = (
    Topic("standoff-filters", "Where is the target? Filters compared",
          (Figure("standoff-position", "Standoff: position error over time", f"Mean over the runs. {GREY}",
                  draw_error("position_error_m", "position error [m]")),
           Figure("standoff-velocity", "Standoff: velocity error over time", f"Mean over the runs. {GREY}",
                  draw_error("velocity_error_mps", "velocity error [m/s]"))),
          lambda study: study.settings["guidance"] == "lvfg" and study.settings["visibility"] == "inout" and
          study.settings["particles"] == PAGE["particles"]),
    Topic("standoff-particles", "How many particles?",
          (Figure("standoff-particles", "Standoff: distance against the number of particles (the paper's Figure 5)",
                  "Mean wanted distance in the outages, before the limit of its rate.", draw_particles),),
          lambda study: study.settings["particles"] != PAGE["particles"]),
    Topic("standoff-guidance", "Keeping the distance: guidance laws compared",
          (Figure("standoff-orbits-lvfg", "Standoff: orbits of the UAVs and the target, LVFG", "One run.",
                  draw_orbits("lvfg")),
           Figure("standoff-orbits-nmpc", "Standoff: orbits of the UAVs and the target, NMPC", "One run.",
                  draw_orbits("nmpc")),
           Figure("standoff-field", "Standoff: the vector field around the target",
                  "One run at 15 s: the field of the wanted distance (from its formula), and the last 8 s of the UAVs "
                  "relative to the estimate.", draw_field),
           Figure("standoff-distance", "Standoff: wanted and kept distance", f"One run, LVFG. {GREY}", draw_distance),
           Figure("standoff-phase", "Standoff: phase error over time", f"Mean over the runs. {GREY}",
                  draw_law("phase_error_deg", "phase error [deg]")),
           Figure("standoff-distance-error", "Standoff: distance error over time", f"Mean over the runs. {GREY}",
                  draw_law("standoff_error_m", "distance error [m]"))),
          lambda study: True),
)
