"""How the figures look: drawn once by matplotlib, then made part of the page.

matplotlib draws with one marker colour for each role; in the SVG these become CSS variables of the page, so that a
figure follows the page from light to dark. Text stays text, in the page's font.
"""
import html
import io
import re

# Role -> the colour that stands for it while drawing; each occurs nowhere else.
ROLES = {name: f"#0{i:x}0{i:x}0{i:x}" for i, name in enumerate(
    ["ink", "muted", "grid", "surface", "ours", "other", "third", "fourth", "measured", "band"], start=1)}
INK, MUTED, GRID, SURFACE = (ROLES[name] for name in ("ink", "muted", "grid", "surface"))
OURS, OTHER, THIRD, FOURTH = (ROLES[name] for name in ("ours", "other", "third", "fourth"))
MEASURED, BAND = ROLES["measured"], ROLES["band"]

WIDTH_IN = 4.6
HEIGHT_IN = 3.2

RC = {
    "figure.figsize": (WIDTH_IN, HEIGHT_IN), "figure.facecolor": "none", "savefig.facecolor": "none",
    "figure.constrained_layout.use": True,
    "axes.facecolor": "none", "axes.edgecolor": MUTED, "axes.labelcolor": INK, "axes.linewidth": 0.7,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "axes.axisbelow": True,
    "axes.titlesize": 10, "axes.titlelocation": "left", "axes.titlecolor": INK, "axes.labelsize": 10.5,
    "grid.color": GRID, "grid.linewidth": 0.7,
    "xtick.color": MUTED, "ytick.color": MUTED, "xtick.labelcolor": INK, "ytick.labelcolor": INK,
    "xtick.labelsize": 10, "ytick.labelsize": 10, "xtick.major.size": 3, "ytick.major.size": 3,
    "text.color": INK, "font.size": 10.5, "font.family": "sans-serif",
    "legend.frameon": False, "legend.fontsize": 10, "legend.handlelength": 1.6, "legend.borderaxespad": 0.2,
    "lines.linewidth": 1.6, "lines.solid_capstyle": "round", "patch.linewidth": 0,
    "svg.fonttype": "none", "svg.hashsalt": "pflight", "path.simplify_threshold": 0.3,
}


def new_figure(height_in=HEIGHT_IN, rows=1, **options):
    """A figure with axes one above the other."""
    from matplotlib import pyplot

    return pyplot.subplots(rows, 1, figsize=(WIDTH_IN, height_in), **options)


def to_scale(figure, axes):
    """The same scale on both axes, and the figure as high as that needs."""
    axes.autoscale_view()
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    wanted = 0.9 + (WIDTH_IN - 0.8) * (top - bottom) / (right - left)
    figure.set_figheight(min(max(wanted, 2.2), 4.8))
    axes.set_aspect("equal", adjustable="datalim" if wanted < 2.2 else "box", anchor="SW")


def plain_log(axis):
    """A logarithmic axis with numbers that people read."""
    from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

    lo, hi = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if hi < 200.0 * lo else (1.0,)))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())


def legend(axes, columns=2):
    """Above the axes, where it hides nothing."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, columnspacing=1.2)


def dots(axes, x, y, color, size=1.6, alpha=0.55, label=None):
    """Many points as one path: a fortieth of the bytes of as many markers."""
    import numpy
    from matplotlib.lines import Line2D
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    good = numpy.isfinite(x) & numpy.isfinite(y)
    points = numpy.column_stack([x[good], y[good]])
    if len(points) > 0:
        vertices = numpy.repeat(points, 2, axis=0)
        codes = numpy.tile([Path.MOVETO, Path.LINETO], len(points))
        path = Path(vertices, codes)
        path.should_simplify = False  # it would take points for a line without length
        axes.add_patch(PathPatch(path, facecolor="none", edgecolor=color, linewidth=size, alpha=alpha,
                                 capstyle="round"))
        axes.update_datalim(points)
        axes.autoscale_view()
    if label is not None:
        axes.add_line(Line2D([], [], color=color, linestyle="none", marker="o", markersize=3.5, label=label))


def ticks(axes, x, low, high, color, label=None):
    """Many short vertical lines as one path."""
    import numpy
    from matplotlib.lines import Line2D
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if len(x) > 0:
        vertices = numpy.column_stack([numpy.repeat(x, 2), numpy.tile([low, high], len(x))])
        path = Path(vertices, numpy.tile([Path.MOVETO, Path.LINETO], len(x)))
        path.should_simplify = False
        axes.add_patch(PathPatch(path, facecolor="none", edgecolor=color, linewidth=1.0))
    if label is not None:
        axes.add_line(Line2D([], [], color=color, linestyle="none", marker="|", markersize=8, label=label))


def outages(axes, spans, label):
    """Shades spans of the x axis."""
    for i, (begin, end) in enumerate(spans):
        axes.axvspan(begin, end, color=BAND, alpha=0.5, linewidth=0, label=label if i == 0 else None)


def _round(match):
    return f"{float(match.group(0)):.2f}".rstrip("0").rstrip(".")


def to_svg(figure, name, title, description):
    """The figure as an SVG element for the page. name: unique on the page, becomes the prefix of all ids."""
    from matplotlib import pyplot

    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    pyplot.close(figure)
    svg = buffer.getvalue()
    svg = svg[svg.index("<svg"):].rstrip()
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
    view = re.search(r'viewBox="([^"]*)"', svg).group(1)
    head = (f'<svg class="plot" viewBox="{view}" role="img" aria-labelledby="{name}-title {name}-desc">'
            f'<title id="{name}-title">{html.escape(title)}</title>'
            f'<desc id="{name}-desc">{html.escape(description)}</desc>')
    svg = head + svg[svg.index(">") + 1:]
    svg = re.sub(r'\bid="(?!%s-)' % re.escape(name), f'id="{name}-', svg)
    svg = re.sub(r'xlink:href="#', f'href="#{name}-', svg)
    svg = re.sub(r"url\(#", f"url(#{name}-", svg)
    for role, color in ROLES.items():
        svg = svg.replace(color, f"var(--{role})")
    svg = re.sub(r"font-family: [^;\"]*;?", "", svg)
    svg = re.sub(r"font: ([0-9.]+)px [^;\"]*", r"font-size: \1px", svg)
    # Two decimals of a point are finer than any screen.
    svg = re.sub(r'(?<= d=")[^"]*|(?<= transform=")[^"]*',
                 lambda match: re.sub(r"-?\d+\.\d{3,}(?:e-?\d+)?", _round, match.group(0)), svg)
    return re.sub(r">\s+<", "><", svg)
