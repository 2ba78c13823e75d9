"""ArduPilot's DataFlash logs (.bin, .log) and MAVLink telemetry (.tlog), by pymavlink."""
import math
import os

import numpy as np

os.environ.setdefault("MAVLINK20", "1")
from pymavlink import DFReader, mavutil  # noqa: E402

FIX_3D = 3
LOG_SOURCES = {"gps.csv": "GPS", "baro.csv": "BARO", "air.csv": "ARSP", "att.csv": "ATT", "imu.csv": "IMU",
               "nav.csv": "POS, with velocities of XKF1, NKF1 or EKF1", "odometry.csv": None, "truth.csv": "SIM (simulators)",
               "modes.csv": "MODE"}
TELEMETRY_SOURCES = {"gps.csv": "GPS_RAW_INT", "baro.csv": "SCALED_PRESSURE, by the standard atmosphere", "air.csv": "VFR_HUD", "att.csv": "ATTITUDE",
                     "imu.csv": "HIGHRES_IMU or SCALED_IMU", "nav.csv": "GLOBAL_POSITION_INT", "odometry.csv": None,
                     "truth.csv": "SIM_STATE (simulators)", "modes.csv": "HEARTBEAT of the autopilot"}


class _Rows:
    """Rows of each file as they come."""

    def __init__(self):
        self.rows = {}

    def add(self, name, t_us, **row):
        self.rows.setdefault(name, []).append({"t_us": t_us, **row})

    def tables(self):
        tables = {}
        for name, rows in self.rows.items():
            columns = dict.fromkeys(key for row in rows for key in row)
            tables[name] = {c: np.array([row.get(c, math.nan) for row in rows], float) for c in columns}
        return tables


def _course(speed, course_deg):
    return speed * math.cos(math.radians(course_deg)), speed * math.sin(math.radians(course_deg))


# ---- DataFlash ------------------------------------------------------------------------------------------------------------


def _df_gps(m, out):
    if m.Status >= FIX_3D and getattr(m, "I", 0) == 0:
        vn, ve = _course(m.Spd, m.GCrs)
        out.add("gps.csv", m.TimeUS, lat_deg=m.Lat, lon_deg=m.Lng, alt_msl_m=m.Alt, vn_mps=vn, ve_mps=ve,
                vd_mps=getattr(m, "VZ", math.nan), sats=m.NSats)


def _df_imu(m, out):
    if getattr(m, "I", 0) == 0:
        out.add("imu.csv", m.TimeUS, gx_radps=m.GyrX, gy_radps=m.GyrY, gz_radps=m.GyrZ, ax_mps2=m.AccX, ay_mps2=m.AccY,
                az_mps2=m.AccZ)


def _df_attitude(m, out):
    out.add("att.csv", m.TimeUS, roll_rad=math.radians(m.Roll), pitch_rad=math.radians(m.Pitch),
            yaw_rad=(math.radians(m.Yaw) + math.pi) % (2 * math.pi) - math.pi)


def _df_velocity(m, out):
    if getattr(m, "C", getattr(m, "I", 0)) == 0:
        out.add("velocity", m.TimeUS, vn_mps=m.VN, ve_mps=m.VE, vd_mps=m.VD)


_DATAFLASH = {
    "GPS": _df_gps, "IMU": _df_imu, "ATT": _df_attitude, "XKF1": _df_velocity, "NKF1": _df_velocity, "EKF1": _df_velocity,
    "BARO": lambda m, out: getattr(m, "I", 0) == 0 and out.add("baro.csv", m.TimeUS, baro_alt_m=m.Alt),
    "ARSP": lambda m, out: getattr(m, "I", 0) == 0 and out.add("air.csv", m.TimeUS, ias_mps=m.Airspeed,
                                                               dpress_pa=getattr(m, "DiffPress", math.nan)),
    "POS": lambda m, out: out.add("nav.csv", m.TimeUS, lat_deg=m.Lat, lon_deg=m.Lng, alt_msl_m=m.Alt),
    "SIM": lambda m, out: out.add("truth.csv", m.TimeUS, lat_deg=m.Lat, lon_deg=m.Lng),
    "MODE": lambda m, out: out.add("modes.csv", m.TimeUS, ardupilot_mode=getattr(m, "ModeNum", math.nan)),
}


def read_dataflash(path):
    with open(path, "rb") as file:
        text = file.read(2) != b"\xa3\x95"  # a .log may be either
    log = (DFReader.DFReader_text if text else DFReader.DFReader_binary)(str(path), zero_time_base=True)
    out = _Rows()
    while (m := log.recv_match(type=list(_DATAFLASH))) is not None:
        _DATAFLASH[m.get_type()](m, out)
    tables = out.tables()
    velocity, nav = tables.pop("velocity", None), tables.get("nav.csv")
    if velocity is not None and nav is not None:
        for name in ("vn_mps", "ve_mps", "vd_mps"):
            nav[name] = np.interp(nav["t_us"], velocity["t_us"], velocity[name])
    return tables


# ---- Telemetry --------------------------------------------------------------------------------------------------------------


def _ml_gps(m, t_us, out):
    if m.fix_type >= FIX_3D:
        vn, ve = _course(m.vel * 1e-2, m.cog * 1e-2) if m.vel < 65535 and m.cog < 65535 else (math.nan, math.nan)
        out.add("gps.csv", t_us, lat_deg=m.lat * 1e-7, lon_deg=m.lon * 1e-7, alt_msl_m=m.alt * 1e-3, vn_mps=vn, ve_mps=ve,
                sats=m.satellites_visible)


def _ml_global(m, t_us, out):
    out.add("nav.csv", t_us, lat_deg=m.lat * 1e-7, lon_deg=m.lon * 1e-7, alt_msl_m=m.alt * 1e-3, vn_mps=m.vx * 1e-2,
            ve_mps=m.vy * 1e-2, vd_mps=m.vz * 1e-2)


def _ml_hud(m, t_us, out):
    out.add("air.csv", t_us, ias_mps=m.airspeed)


def _ml_pressure(m, t_us, out):
    if m.press_abs > 0:
        out.add("baro.csv", t_us, baro_alt_m=44330.77 * (1.0 - (m.press_abs / 1013.25) ** 0.190263))


def _ml_imu(m, t_us, out):
    # SCALED_IMU in mrad/s and mg, HIGHRES_IMU in SI.
    turn, push = (1.0, 1.0) if m.get_type() == "HIGHRES_IMU" else (1e-3, 9.80665e-3)
    out.add("imu.csv", t_us, gx_radps=m.xgyro * turn, gy_radps=m.ygyro * turn, gz_radps=m.zgyro * turn,
            ax_mps2=m.xacc * push, ay_mps2=m.yacc * push, az_mps2=m.zacc * push)


def _ml_heartbeat(m, t_us, out):
    modes = out.rows.get("modes.csv", [])
    if m.autopilot == mavutil.mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA and (
            not modes or modes[-1]["ardupilot_mode"] != m.custom_mode):
        out.add("modes.csv", t_us, ardupilot_mode=m.custom_mode)


_TELEMETRY = {
    "GPS_RAW_INT": _ml_gps, "GLOBAL_POSITION_INT": _ml_global, "VFR_HUD": _ml_hud,
    "SCALED_PRESSURE": _ml_pressure, "HIGHRES_IMU": _ml_imu,
    "SCALED_IMU": _ml_imu, "HEARTBEAT": _ml_heartbeat,
    "ATTITUDE": lambda m, t_us, out: out.add("att.csv", t_us, roll_rad=m.roll, pitch_rad=m.pitch, yaw_rad=m.yaw),
    "SIM_STATE": lambda m, t_us, out: out.add("truth.csv", t_us, lat_deg=m.lat, lon_deg=m.lon),
}


def read_telemetry(path):
    log = mavutil.mavlink_connection(str(path), notimestamps=False, dialect="ardupilotmega")
    out = _Rows()
    # The time is that of reception, which the ground station wrote: the messages' own stand still in some of them.
    while (m := log.recv_match(type=list(_TELEMETRY))) is not None:
        _TELEMETRY[m.get_type()](m, round(m._timestamp * 1e6), out)
    return out.tables()
