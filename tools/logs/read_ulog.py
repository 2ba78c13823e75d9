"""PX4's ULog, by pyulog. Old and new names of its fields."""
import numpy as np
import pyulog

from columns import angles

SOURCES = {"gps.csv": "vehicle_gps_position", "baro.csv": "vehicle_air_data", "air.csv": "airspeed, differential_pressure",
           "att.csv": "vehicle_attitude", "imu.csv": "sensor_combined", "nav.csv": "vehicle_local_position",
           "odometry.csv": None, "truth.csv": "vehicle_local_position_groundtruth (simulators)", "modes.csv": "vehicle_status"}
FIX_3D = 3


def read(path):
    log = pyulog.ULog(str(path))
    topics = {}
    for data in log.data_list:
        topics.setdefault(data.name, data.data)  # the first instance of each
    makers = {"gps.csv": _gps, "baro.csv": _baro, "air.csv": _air, "att.csv": _attitude, "imu.csv": _imu, "nav.csv": _nav,
              "truth.csv": _truth, "modes.csv": _modes}
    tables = {name: make(topics) for name, make in makers.items()}
    return {name: table for name, table in tables.items() if table and len(table["t_us"])}


def _scaled(data, name, old_name, factor):
    if name in data:
        return data[name].astype(float)
    return data[old_name] * factor if old_name in data else None


def _gps(topics):
    d = topics.get("vehicle_gps_position")
    if d is None:
        return None
    table = {"t_us": d["timestamp"], "lat_deg": _scaled(d, "latitude_deg", "lat", 1e-7),
             "lon_deg": _scaled(d, "longitude_deg", "lon", 1e-7), "alt_msl_m": _scaled(d, "altitude_msl_m", "alt", 1e-3),
             "vn_mps": d.get("vel_n_m_s"), "ve_mps": d.get("vel_e_m_s"), "vd_mps": d.get("vel_d_m_s"),
             "eph_m": d.get("eph"), "epv_m": d.get("epv"), "sats": d.get("satellites_used")}
    good = d["fix_type"] >= FIX_3D if "fix_type" in d else np.ones(len(d["timestamp"]), bool)
    return {name: column[good] for name, column in table.items() if column is not None}


def _baro(topics):
    d = topics.get("vehicle_air_data", topics.get("sensor_combined", {}))
    return {"t_us": d["timestamp"], "baro_alt_m": d["baro_alt_meter"]} if "baro_alt_meter" in d else None


def _air(topics):
    d, p = topics.get("airspeed"), topics.get("differential_pressure")
    if d is None:
        return None
    table = {"t_us": d["timestamp"], "tas_mps": d.get("true_airspeed_m_s"), "ias_mps": d.get("indicated_airspeed_m_s")}
    if p is not None and "differential_pressure_filtered_pa" in p:
        table["dpress_pa"] = np.interp(d["timestamp"], p["timestamp"], p["differential_pressure_filtered_pa"])
    return table


def _attitude(topics):
    d = topics.get("vehicle_attitude")
    return d and {"t_us": d["timestamp"], **angles([d[f"q[{k}]"] for k in range(4)])}


def _imu(topics):
    d = topics.get("sensor_combined")
    return d and {"t_us": d["timestamp"], **{f"g{axis}_radps": d[f"gyro_rad[{k}]"] for k, axis in enumerate("xyz")},
                  **{f"a{axis}_mps2": d[f"accelerometer_m_s2[{k}]"] for k, axis in enumerate("xyz")}}


def _local(d):
    if d is None:
        return None
    table = {"t_us": d["timestamp"], "vn_mps": d["vx"], "ve_mps": d["vy"], "vd_mps": d["vz"]}
    if "ref_lat" in d:  # degrees, or 1e-7 of them where it is an integer
        factor = 1.0 if d["ref_lat"].dtype.kind == "f" else 1e-7
        table.update(x_m=d["x"], y_m=d["y"], ref_lat_deg=d["ref_lat"] * factor, ref_lon_deg=d["ref_lon"] * factor)
        if "ref_alt" in d:
            table["alt_msl_m"] = d["ref_alt"] - d["z"]
    else:
        table.update(north_m=d["x"], east_m=d["y"])
    return table


def _nav(topics):
    return _local(topics.get("vehicle_local_position"))


def _truth(topics):
    return _local(topics.get("vehicle_local_position_groundtruth"))


def _modes(topics):
    d = topics.get("vehicle_status")
    if d is None or "nav_state" not in d:
        return None
    changed = np.flatnonzero(np.diff(d["nav_state"].astype(int), prepend=-1))
    return {"t_us": d["timestamp"][changed], "px4_nav_state": d["nav_state"][changed]}
