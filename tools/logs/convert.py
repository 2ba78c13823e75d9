"""From a log to the CSV files of tools/run replay, with what lacks said."""
import pathlib

import numpy as np

from columns import DECIMALS, FILES, place, present

KINDS = [".ulg", ".bin", ".log", ".tlog", ".csv"]


class Usage(Exception):
    """The command line is wrong."""


class Unreadable(Exception):
    """The log is."""


def _read(path, entries):
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise Usage(f"{path}: the kinds of logs are: {', '.join(KINDS)}")
    if entries and kind != ".csv":
        raise Usage("--map is for FILE.csv: the columns of other logs are known")
    if not path.is_file():
        raise Unreadable(f"{path}: no such file")
    if kind == ".csv":
        import read_table
        return read_table.read(path, entries, Usage, Unreadable), read_table.SOURCES
    try:
        if kind == ".ulg":
            import read_ulog
            return read_ulog.read(path), read_ulog.SOURCES
        import read_mavlink
        if kind == ".tlog":
            return read_mavlink.read_telemetry(path), read_mavlink.TELEMETRY_SOURCES
        return read_mavlink.read_dataflash(path), read_mavlink.LOG_SOURCES
    except Exception as wrong:  # whatever a damaged file does to a reader
        raise Unreadable(f"{path}: cannot be read as {kind[1:]}: {type(wrong).__name__}: {wrong}") from wrong


def _in_order(table, rate_hz):
    """Sorted by time, and the first row of every period only."""
    order = np.argsort(table["t_us"], kind="stable")
    if rate_hz is not None and len(order):
        slot = np.floor((table["t_us"][order] - table["t_us"][order[0]]) * 1e-6 * rate_hz)
        order = order[np.flatnonzero(np.diff(slot, prepend=-1))]
    return {name: np.asarray(column)[order] for name, column in table.items()}


def _cell(value, decimals):
    return "" if np.isnan(value) else f"{value:.{decimals}f}"


def _write(path, table, t0_us):
    columns = [c for c in FILES[path.name] if c in table]
    t_s = (table["t_us"].astype(float) - t0_us) * 1e-6
    lines = ["t_s," + ",".join(columns)]
    for i, t in enumerate(t_s):
        lines.append(f"{t:.6f}," + ",".join(_cell(float(table[c][i]), DECIMALS.get(c, 6)) for c in columns))
    path.write_text("\n".join(lines) + "\n")
    return columns


def convert(file, out, rate_hz=None, entries=()):
    """Writes the files; what was found and what lacks, as text."""
    path, folder = pathlib.Path(file), pathlib.Path(out)
    tables, sources = _read(path, list(entries))
    tables = {name: present(table) for name, table in tables.items()}
    tables = {name: _in_order(table, rate_hz if name != "modes.csv" else None) for name, table in tables.items()
              if len(table) > 1 and len(table["t_us"])}
    if not tables:
        raise Unreadable(f"{path}: nothing in it that a filter could use; `tools/log columns` says what is looked for")
    place(tables)
    first = tables.get("gps.csv", min(tables.values(), key=lambda table: table["t_us"][0]))
    t0_us = float(first["t_us"][0])
    folder.mkdir(parents=True, exist_ok=True)
    said = []
    for name, wanted in FILES.items():
        if name in tables:
            columns = _write(folder / name, tables[name], t0_us)
            span_s = float(tables[name]["t_us"][-1] - tables[name]["t_us"][0]) * 1e-6
            rows = len(tables[name]["t_us"])
            rate = f", {(rows - 1) / span_s:.1f} Hz" if span_s > 0 else ""
            lacks = [c for c in wanted if c not in columns and c not in ("px4_nav_state", "ardupilot_mode")]
            said.append(f"{name:<13s} {rows} rows{rate}: {', '.join(columns)}" +
                        (f" (the log has no {', '.join(lacks)})" if lacks else ""))
        elif sources[name]:
            said.append(f"{name:<13s} not written: the log has no {sources[name]}")
    said.append(f"t_s = 0 is {'the first fix' if 'gps.csv' in tables else 'the first row'}; "
                f"fly it with: tools/run replay --data {folder}")
    return "\n".join(said)


def describe():
    import read_mavlink
    import read_ulog
    lines = []
    for name, columns in FILES.items():
        lines.append(f"{name}: t_s, {', '.join(columns)}")
        for kind, sources in ((".ulg", read_ulog.SOURCES), (".bin, .log", read_mavlink.LOG_SOURCES),
                              (".tlog", read_mavlink.TELEMETRY_SOURCES)):
            if sources[name]:
                lines.append(f"    {kind:<10s} {sources[name]}")
    lines.append(".csv: columns of these names or usual other ones; --map OURS=THEIRS[*FACTOR] for the rest")
    return "\n".join(lines)
