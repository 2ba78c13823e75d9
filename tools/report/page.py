"""The report as one HTML page: no script, nothing from outside, readable with any browser."""
import html
import math
import pathlib

UNCOMPARED_SHOWN = 8  # a longer table of figures that nothing is compared with folds
BESIDE_MAX = 2  # studies whose tables fit beside a single figure
STYLE = pathlib.Path(__file__).with_name("page.css")


def escape(text):
    return html.escape(str(text))


def number(value, digits=4):
    """A figure for people; empty where there is none."""
    if value is None:
        return ""
    if value != 0.0 and abs(value) < 10.0 ** -digits:
        return f"{value:.2g}"
    if abs(value) >= 1000.0:
        return f"{value:.1f}"
    return f"{value:.{digits}f}"


def band(lo, hi):
    """The acceptance; a side without a bound has none in the summary."""
    if lo is None and hi is None:
        return ""
    # A band as narrow as rounding cannot be read off four decimals.
    digits = 7 if lo is not None and hi is not None and hi - lo < 1e-3 <= abs(hi) else 4
    if lo is None or (lo == 0.0 and hi is not None):
        return f"≤ {number(hi, digits)}"
    if hi is None:
        return f"≥ {number(lo, digits)}"
    return f"{number(lo, digits)} to {number(hi, digits)}"


def badge(verdict):
    if verdict is None:
        return ""
    return f'<span class="verdict {verdict}">{"✓ pass" if verdict == "pass" else "✗ FAIL"}</span>'


def metric_row(name, metric):
    cells = (("ours", number(metric["mean"])), ("± error", number(metric["stderr"])),
             ("paper", number(metric["paper"])), ("reference", number(metric["reference"])),
             ("accepted", band(metric["lo"], metric["hi"]) if metric["verdict"] else ""))
    columns = "".join(f'<td data-label="{label}">{escape(value)}</td>' if value else "<td></td>"
                      for label, value in cells)
    return f'<tr><th scope="row">{escape(name)}</th>{columns}<td>{badge(metric["verdict"])}</td></tr>'


def table(rows):
    heads = "".join(f'<th scope="col">{head}</th>' for head in
                    ("metric", "ours", "± error", "paper", "reference", "accepted", "verdict"))
    return f"<table><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def is_compared(metric):
    return metric["verdict"] is not None or metric["paper"] is not None or metric["reference"] is not None


def metrics_table(study):
    """What there is to compare with stands first; the rest, if there is both, folds."""
    compared = [metric_row(name, metric) for name, metric in study.metrics.items() if is_compared(metric)]
    others = [metric_row(name, metric) for name, metric in study.metrics.items() if not is_compared(metric)]
    tables = table(compared) if compared else ""
    if others and (compared or len(others) > UNCOMPARED_SHOWN):
        tables += f"<details><summary>{len(others)} metrics without a comparison</summary>{table(others)}</details>"
    elif others:
        tables = table(others)
    return (f'<div class="wide" tabindex="0" role="region" aria-label="Metrics of {escape(study.id)}">'
            f"{tables}</div>")


def microseconds(timing, prefix=""):
    values = [timing.get(f"{prefix}{name}_us") for name in ("p50", "p99", "max")]
    return "p50 {:.1f}, p99 {:.1f}, max {:.1f} µs".format(*values) if None not in values else None


def timing_line(study):
    timing = study.timing
    if timing.get("verdict") is None:
        return ""
    reason = f" ({study.budget_reason})" if study.budget_reason else ""
    resampling = microseconds(timing, "resample_")
    line = (f"Filter cycle: {microseconds(timing)}; budget {timing['budget_us']:g} µs{reason}, "
            f"{timing['overruns']} cycles over it {{}}")
    if resampling:
        line += f" Of it resampling: {resampling}, in {100.0 * timing['resampled_share']:.1f} % of the cycles."
    return '<p class="quiet">' + escape(line).replace("{}", badge(timing["verdict"])) + "</p>"


def study_title(study):
    own = {key: value for key, value in study.settings.items() if key not in ("filter", "particles", "runs", "seed")}
    words = [study.settings["filter"], *(f"{key} {own[key]}" for key in study.special if key in own)]
    return (f'<h4 id="{escape(study.id)}">{escape(", ".join(words))}</h4>'
            f'<p class="quiet">{study.settings["particles"]} particles, {study.settings["runs"]} runs, '
            f'seed {study.settings["seed"]}</p>')


def command(study):
    settings = dict(study.settings)
    line = [f"tools/run {study.scenario}"]
    line += [f"--{key} {settings.pop(key)}" for key in ("filter", "particles", "runs", "seed")]
    return " ".join(line + [f"--set {key}={value}" for key, value in settings.items()])


def study_section(study):
    notes = "".join(f"<li>{escape(note)}</li>" for note in study.notes if note.strip())
    return (f'<div class="study">{study_title(study)}{metrics_table(study)}{timing_line(study)}'
            + (f'<ul class="notes">{notes}</ul>' if notes else "")
            + f"<details><summary>Replay</summary><p><code>{escape(command(study))}</code></p>"
              f"<p>hash {escape(study.hash)}, {study.elapsed_s:.1f} s</p></details></div>")


def figure_section(figure, svg, lacks):
    """One of svg and lacks, the reason for there being none."""
    caption = f"<figcaption><b>{escape(figure.title)}</b><span>{escape(figure.caption)}</span></figcaption>"
    body = svg if svg is not None else f'<p class="lacking">not drawn: {escape(lacks)}</p>'
    return f'<figure id="fig-{escape(figure.id)}">{body}{caption}</figure>'


def topic_section(topic, figures, studies):
    grid = f'<div class="figures">{"".join(figures)}</div>' if figures else ""
    tables = f'<div>{"".join(map(study_section, studies))}</div>' if studies else ""
    kind = "topic single" if len(figures) == 1 and 0 < len(studies) <= BESIDE_MAX else "topic"
    return (f'<section class="{kind}" aria-labelledby="{topic.id}-head"><h3 id="{topic.id}-head">'
            f"{escape(topic.title)}</h3>{grid}{tables}</section>")


def counted(studies):
    """Judged figures and how many of them are accepted; time budgets count."""
    verdicts = [metric["verdict"] for study in studies for metric in study.metrics.values()]
    verdicts += [study.timing.get("verdict") for study in studies]
    return sum(verdict is not None for verdict in verdicts), verdicts.count("pass")


def failures(studies):
    """Links to what is outside its acceptance."""
    found = []
    for study in studies:
        names = [name for name, metric in study.metrics.items() if metric["verdict"] == "fail"]
        if study.timing.get("verdict") == "fail":
            names.append("p50 of the filter cycle")
        found += [f'<li><a href="#{escape(study.id)}">{escape(study.id)}</a>: {escape(name)}</li>' for name in names]
    return f'<div class="topic"><h3>Outside the acceptance</h3><ul class="notes">{"".join(found)}</ul></div>' \
        if found else ""


def skipped_section(skipped):
    return "".join(f'<section><h2 id="{escape(entry["scenario"])}">{escape(entry["scenario"])}</h2>'
                   f'<p class="topic">skipped: {escape(entry["reason"])}; its recordings are published here: '
                   f'{escape(entry["recordings"])}</p></section>' for entry in skipped)


def navigation(scenarios, results):
    entries = []
    for name in scenarios:
        judged, accepted = counted(results.of(name))
        entries.append(f'<li><a href="#{escape(name)}">{escape(name)} <small>{accepted} of {judged}</small></a></li>')
    entries += [f'<li><a href="#{escape(entry["scenario"])}">{escape(entry["scenario"])} <small>skipped</small></a></li>'
                for entry in results.skipped]
    return f'<nav id="scenarios" tabindex="-1" aria-label="Scenarios"><ul>{"".join(entries)}</ul></nav>'


def page(results, scenarios):
    """scenarios: name -> list of topics as HTML."""
    judged, accepted = counted(results.studies)
    verdict = "pass" if results.accepted else "fail"
    elapsed = math.fsum(study.elapsed_s for study in results.studies)
    sections = "".join(
        f'<section aria-labelledby="{escape(name)}"><h2 id="{escape(name)}" tabindex="-1">{escape(name)}</h2>'
        f'<p class="lead">{escape(results.of(name)[0].summary)} <a href="#scenarios">All scenarios</a></p>{"".join(topics)}</section>'
        for name, topics in scenarios.items())
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<link rel="icon" href="data:,">
<title>pflight: scenarios against the papers</title>
<style>
{STYLE.read_text(encoding="utf-8")}</style>
</head>
<body>
<a class="skip" href="#main">Skip to the results</a>
<header>
<h1>pflight: scenarios against the papers</h1>
<p><span class="verdict {verdict}">{accepted} of {judged}</span> judged figures are within their stated acceptance.
Each table has our figure and its standard error beside the paper's and the reference of the scenario's page.</p>
{navigation(scenarios, results)}
</header>
<main id="main" tabindex="-1">
{failures(results.studies)}{sections}{skipped_section(results.skipped)}
</main>
<footer>Made by tools/run from {len(results.studies)} studies, which took {elapsed:.0f} s. The figures behind this page:
summary.json, junit.xml and csv/.</footer>
</body>
</html>
"""
