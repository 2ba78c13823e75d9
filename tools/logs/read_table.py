"""A table of one's own: FILE.csv with a header. Columns of ours by their names, by usual other ones, or by --map."""
import csv

import numpy as np

from columns import FILES

SOURCES = {name: "columns of these names, or --map" for name in FILES}
TIMES = {"t_us": 1.0, "time_us": 1.0, "timestamp": 1.0, "TimeUS": 1.0, "t_ms": 1e3, "time_ms": 1e3, "t_s": 1e6, "time_s": 1e6,
         "time": 1e6, "t": 1e6}
ALIASES = {"lat_deg": ["latitude", "lat", "latitude_deg"], "lon_deg": ["longitude", "lon", "lng", "longitude_deg"],
           "alt_msl_m": ["altitude", "alt", "altitude_m"], "north_m": ["north"], "east_m": ["east"],
           "vn_mps": ["vel_n_m_s", "vn"], "ve_mps": ["vel_e_m_s", "ve"], "vd_mps": ["vel_d_m_s", "vd"],
           "baro_alt_m": ["baro_alt_meter", "baro_alt"], "ias_mps": ["airspeed", "indicated_airspeed_m_s"],
           "tas_mps": ["true_airspeed_m_s"]}


def parse_map(entries, usage):
    chosen = {}
    known = {"t_s", *(c for columns in FILES.values() for c in columns)}
    for entry in entries:
        ours, _, theirs = entry.partition("=")
        name, _, factor = theirs.rpartition("*") if "*" in theirs else (theirs, "", "1")
        try:
            chosen[ours] = (name, float(factor))
        except ValueError:
            raise usage(f"--map {entry}: give OURS=THEIRS or OURS=THEIRS*FACTOR") from None
        if ours not in known or not name:
            raise usage(f"--map {entry}: the columns are: {', '.join(sorted(known))}")
    return chosen


def read(path, entries, usage, unreadable):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    if len(rows) < 2:
        raise unreadable(f"{path}: expected a header and rows below it")
    head = [name.strip() for name in rows[0]]

    def numbers(name):
        at = head.index(name)
        try:
            return np.array([float(row[at] or "nan") if at < len(row) else np.nan for row in rows[1:]])
        except ValueError as wrong:
            raise unreadable(f"{path}, column {name}: {wrong}") from None

    chosen = parse_map(entries, usage)
    for ours, (theirs, _) in chosen.items():
        if theirs not in head:
            raise usage(f"--map {ours}={theirs}: {path} has no such column; its columns are: {', '.join(head)}")
    time = next((name for name in TIMES if name in head), None)
    if "t_s" in chosen:
        t_us = numbers(chosen["t_s"][0]) * chosen["t_s"][1] * 1e6
    elif time is not None:
        t_us = numbers(time) * TIMES[time]
    else:
        raise usage(f"{path}: no column for the time among {', '.join(head)}: name it with --map t_s=NAME*FACTOR")
    tables = {}
    for name, columns in FILES.items():
        table = {"t_us": t_us}
        for ours in columns:
            theirs = next((n for n in [ours, *ALIASES.get(ours, [])] if n in head), None)
            if ours in chosen:
                table[ours] = numbers(chosen[ours][0]) * chosen[ours][1]
            elif theirs is not None:
                table[ours] = numbers(theirs)
        if len(table) > 1 and name not in ("nav.csv", "truth.csv"):  # positions of a table are the measured ones
            some = ~np.all(np.isnan([table[c] for c in table if c != "t_us"]), axis=0) & ~np.isnan(t_us)
            tables[name] = {c: column[some] for c, column in table.items()}
    return tables
