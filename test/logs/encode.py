"""A flight written as a ULog, a DataFlash log, MAVLink telemetry and a table: what the tests of tools/log import.

The flight is the recorded one of ../shared/data where that is here, and one made up otherwise."""
import csv
import math
import os
import pathlib
import struct
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = pathlib.Path(os.environ.get("PFLIGHT_DATA") or ROOT.parent / "shared/data")
GPS = ["lat_deg", "lon_deg", "alt_msl_m", "north_m", "east_m", "vn_mps", "ve_mps", "vd_mps", "eph_m", "epv_m", "sats"]
EPOCH_US = 326_849_000  # of the first fix on the autopilot's clock


def recorded(rows=600):
    """Columns of gps.csv and of nav.csv, and where they come from."""
    folder = DATA / "fixedwing_px4_proto"
    if not (folder / "gps.csv").exists():
        return made_up(rows), "a flight made up"
    tables = {}
    for name in ("gps.csv", "nav.csv"):
        with open(folder / name, newline="") as file:
            read = list(csv.DictReader(file))[:rows]
        tables[name] = {c: np.array([float(row[c]) for row in read]) for c in read[0]}
    return tables, "the recorded flight"


def made_up(rows):
    """A circle of 80 m at 16 m/s, with honest noise."""
    random = np.random.default_rng(3)
    t = np.arange(rows) * 0.2
    a = 16.0 / 80.0 * t
    north, east = 80 * np.sin(a), 80 * (1 - np.cos(a))
    gps = {"t_s": t, "north_m": north + random.normal(0, 1, rows), "east_m": east + random.normal(0, 1, rows),
           "alt_msl_m": 278.25 + 5 * np.sin(0.1 * t), "vn_mps": 16 * np.cos(a), "ve_mps": 16 * np.sin(a),
           "vd_mps": -0.5 * np.cos(0.1 * t), "eph_m": np.full(rows, 0.9), "epv_m": np.full(rows, 1.4),
           "sats": np.full(rows, 14.0)}
    gps["north_m"][0] = gps["east_m"][0] = 0.0
    gps["lat_deg"] = 45.2206015 + gps["north_m"] / 111142.0
    gps["lon_deg"] = -93.1453379 + gps["east_m"] / 78566.0
    nav = {"t_s": t, "north_m": north, "east_m": east, "alt_msl_m": gps["alt_msl_m"], "vn_mps": gps["vn_mps"],
           "ve_mps": gps["ve_mps"], "vd_mps": gps["vd_mps"]}
    return {"gps.csv": gps, "nav.csv": nav}


def times_us(table):
    return np.round(table["t_s"] * 1e6).astype(np.int64) + EPOCH_US


def e7(degrees):
    return np.round(np.asarray(degrees) * 1e7).astype(np.int64)


# ---- ULog -----------------------------------------------------------------------------------------------------------------


class ULogWriter:
    """As the format's page has it: a header, formats (F), subscriptions (A), data (D)."""

    def __init__(self):
        self.head = [b"ULog\x01\x125\x01" + struct.pack("<Q", EPOCH_US), self._message(b"B", bytes(8 + 8 + 24))]
        self.subscribed, self.data, self.layouts = [], [], {}

    @staticmethod
    def _message(kind, body):
        return struct.pack("<Hc", len(body), kind) + body

    def topic(self, name, fields):
        """fields: (C type, name, code of struct)"""
        text = f"{name}:uint64_t timestamp;" + "".join(f"{c} {field};" for c, field, _ in fields)
        self.head.append(self._message(b"F", text.encode()))
        number = len(self.subscribed)
        self.subscribed.append(self._message(b"A", struct.pack("<BH", 0, number) + name.encode()))
        self.layouts[name] = (number, "<Q" + "".join(code for _, _, code in fields))

    def row(self, name, t_us, *values):
        number, layout = self.layouts[name]
        self.data.append((t_us, self._message(b"D", struct.pack("<H", number) + struct.pack(layout, t_us, *values))))

    def write(self, path):
        body = [message for _, message in sorted(self.data, key=lambda entry: entry[0])]
        path.write_bytes(b"".join(self.head + self.subscribed + body))


def write_ulog(tables, path):
    import pyulog
    log, gps, nav = ULogWriter(), tables["gps.csv"], tables["nav.csv"]
    log.topic("vehicle_gps_position", [("int32_t", "lat", "i"), ("int32_t", "lon", "i"), ("int32_t", "alt", "i"),
                                       *[("float", n, "f") for n in ("eph", "epv", "vel_n_m_s", "vel_e_m_s", "vel_d_m_s")],
                                       ("uint8_t", "fix_type", "B"), ("uint8_t", "satellites_used", "B")])
    log.topic("vehicle_local_position", [("double", "ref_lat", "d"), ("double", "ref_lon", "d"),
                                         *[("float", n, "f") for n in ("ref_alt", "x", "y", "z", "vx", "vy", "vz")]])
    log.topic("vehicle_attitude", [("float[4]", "q", "4f")])
    log.topic("vehicle_status", [("uint8_t", "nav_state", "B")])
    ref = (gps["lat_deg"][0], gps["lon_deg"][0])
    for k, t_us in enumerate(times_us(gps)):
        log.row("vehicle_gps_position", t_us, *(int(e7(gps[n][k])) for n in ("lat_deg", "lon_deg")),
                round(gps["alt_msl_m"][k] * 1e3), gps["eph_m"][k], gps["epv_m"][k], gps["vn_mps"][k], gps["ve_mps"][k],
                gps["vd_mps"][k], 3, int(gps["sats"][k]))
        yaw = math.atan2(gps["ve_mps"][k], gps["vn_mps"][k])
        log.row("vehicle_attitude", t_us, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
        log.row("vehicle_status", t_us, 0 if k < 100 else 3)
    log.row("vehicle_gps_position", times_us(gps)[0] - 200000, 0, 0, 0, 99.0, 99.0, 0.0, 0.0, 0.0, 0, 0)  # no fix yet
    for k, t_us in enumerate(times_us(nav)):
        log.row("vehicle_local_position", t_us, *ref, 270.0, nav["north_m"][k], nav["east_m"][k],
                270.0 - nav["alt_msl_m"][k], nav["vn_mps"][k], nav["ve_mps"][k], nav["vd_mps"][k])
    with tempfile.TemporaryDirectory() as folder:
        first = pathlib.Path(folder) / "first.ulg"
        log.write(first)
        pyulog.ULog(str(first)).write_ulog(str(path))  # what is imported is what the package wrote


# ---- DataFlash ---------------------------------------------------------------------------------------------------------------

_DF = {"B": "B", "Q": "Q", "L": "i", "e": "i", "f": "f", "I": "I"}
_DF_SCALE = {"L": 1e7, "e": 1e2}


class DataFlashWriter:
    def __init__(self):
        self.parts, self.formats = [], {}
        self.format("FMT", 128, "BBnNZ", "Type,Length,Name,Format,Columns", 89)

    def format(self, name, number, layout, labels, length=None):
        self.formats[name] = (number, layout)
        size = length or 3 + struct.calcsize("<" + "".join(_DF[c] for c in layout))
        self.parts.append(b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, size, name.encode(), layout.encode(),
                                                        labels.encode()))

    def row(self, name, *values):
        number, layout = self.formats[name]
        scaled = [round(v * _DF_SCALE[c]) if c in _DF_SCALE else v for c, v in zip(layout, values)]
        self.parts.append(b"\xa3\x95" + bytes([number]) + struct.pack("<" + "".join(_DF[c] for c in layout), *scaled))


def write_dataflash(tables, path):
    log, gps, nav = DataFlashWriter(), tables["gps.csv"], tables["nav.csv"]
    log.format("GPS", 130, "QBBLLefff", "TimeUS,Status,NSats,Lat,Lng,Alt,Spd,GCrs,VZ")
    log.format("BARO", 131, "Qf", "TimeUS,Alt")
    log.format("POS", 132, "QLLe", "TimeUS,Lat,Lng,Alt")
    log.format("NKF1", 133, "Qfff", "TimeUS,VN,VE,VD")
    log.format("MODE", 134, "QBBB", "TimeUS,Mode,ModeNum,Rsn")
    t = times_us(gps)
    log.row("MODE", int(t[0]), 10, 10, 0)
    rows = [(int(u), "gps", k) for k, u in enumerate(t)] + [(int(u), "nav", k) for k, u in enumerate(times_us(nav))]
    for u, kind, k in sorted(rows):
        if kind == "gps":
            v = (gps["vn_mps"][k], gps["ve_mps"][k])
            log.row("GPS", u, 3, int(gps["sats"][k]), gps["lat_deg"][k], gps["lon_deg"][k], gps["alt_msl_m"][k],
                    math.hypot(*v), math.degrees(math.atan2(v[1], v[0])) % 360, gps["vd_mps"][k])
            log.row("BARO", u, gps["alt_msl_m"][k] - gps["alt_msl_m"][0])
        else:
            log.row("NKF1", u, nav["vn_mps"][k], nav["ve_mps"][k], nav["vd_mps"][k])
            log.row("POS", u, gps["lat_deg"][0] + nav["north_m"][k] / 111142.0, gps["lon_deg"][0], nav["alt_msl_m"][k])
    path.write_bytes(b"".join(log.parts))


# ---- Telemetry ------------------------------------------------------------------------------------------------------------------


def write_telemetry(tables, path):
    os.environ.setdefault("MAVLINK20", "1")
    from pymavlink import mavutil
    mavlink = mavutil.mavlink
    mav = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    gps = tables["gps.csv"]
    with open(path, "wb") as file:
        for k, t_us in enumerate(times_us(gps)):
            v = (gps["vn_mps"][k], gps["ve_mps"][k])
            course = math.degrees(math.atan2(v[1], v[0])) % 360
            messages = [mavlink.MAVLink_gps_raw_int_message(
                int(t_us), 3, int(e7(gps["lat_deg"][k])), int(e7(gps["lon_deg"][k])), round(gps["alt_msl_m"][k] * 1e3), 90, 140,
                round(math.hypot(*v) * 100), round(course * 100) % 36000, int(gps["sats"][k])),
                mavlink.MAVLink_attitude_message(int(t_us // 1000), 0.1, -0.05, 1.0, 0.0, 0.0, 0.0),
                mavlink.MAVLink_vfr_hud_message(17.0, 16.0, 90, 50, 300.0, 0.0)]
            for message in messages:
                file.write(struct.pack(">Q", 1_492_463_069_000_000 + int(t_us - EPOCH_US)) + message.pack(mav))


def write_table(tables, path):
    gps = tables["gps.csv"]
    lines = ["time_ms,latitude,longitude,altitude,speed_north_cms,speed_east_cms"]
    for k, t in enumerate(times_us(gps)):
        lines.append(f"{t / 1000},{gps['lat_deg'][k]:.9f},{gps['lon_deg'][k]:.9f},{gps['alt_msl_m'][k]:.3f},"
                     f"{100 * gps['vn_mps'][k]:.3f},{100 * gps['ve_mps'][k]:.3f}")
    path.write_text("\n".join(lines) + "\n")
