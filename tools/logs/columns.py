"""The files that a log becomes, their columns, and which columns of which message of each kind of log they are taken from.

A reader hands over tables: columns by name, of one length, `t_us` among them."""
import math

import numpy as np

FILES = {
    "gps.csv": ["lat_deg", "lon_deg", "alt_msl_m", "north_m", "east_m", "vn_mps", "ve_mps", "vd_mps", "eph_m", "epv_m", "sats"],
    "baro.csv": ["baro_alt_m"],
    "air.csv": ["tas_mps", "ias_mps", "dpress_pa"],
    "att.csv": ["roll_rad", "pitch_rad", "yaw_rad"],
    "imu.csv": ["gx_radps", "gy_radps", "gz_radps", "ax_mps2", "ay_mps2", "az_mps2"],
    "nav.csv": ["north_m", "east_m", "alt_msl_m", "vn_mps", "ve_mps", "vd_mps"],
    "odometry.csv": ["v_forward_mps", "yaw_rate_radps"],
    "truth.csv": ["north_m", "east_m"],
    "modes.csv": ["px4_nav_state", "ardupilot_mode"],
}
DECIMALS = {"lat_deg": 9, "lon_deg": 9, "sats": 0, "px4_nav_state": 0, "ardupilot_mode": 0}
# WGS-84
SEMI_MAJOR_M, FLATTENING = 6378137.0, 1.0 / 298.257223563


class Plane:
    """Metres north and east of a point, by the meridian and normal radii there."""

    def __init__(self, lat_deg, lon_deg, alt_m):
        self.lat_deg, self.lon_deg = lat_deg, lon_deg
        e2 = FLATTENING * (2.0 - FLATTENING)
        w2 = 1.0 - e2 * math.sin(math.radians(lat_deg)) ** 2
        self.meridian_m = SEMI_MAJOR_M * (1.0 - e2) / w2**1.5 + alt_m
        self.parallel_m = (SEMI_MAJOR_M / math.sqrt(w2) + alt_m) * math.cos(math.radians(lat_deg))

    def place(self, lat_deg, lon_deg):
        return (np.radians(np.asarray(lat_deg) - self.lat_deg) * self.meridian_m,
                np.radians(np.asarray(lon_deg) - self.lon_deg) * self.parallel_m)


def place(tables):
    """Adds north_m and east_m wherever a table has latitudes, on the plane through the first fix."""
    gps = tables.get("gps.csv")
    if gps is None or "lat_deg" not in gps:
        return
    altitude = float(gps["alt_msl_m"][0]) if "alt_msl_m" in gps else 0.0
    plane = Plane(float(gps["lat_deg"][0]), float(gps["lon_deg"][0]), altitude)
    for table in tables.values():
        if "lat_deg" in table and "lon_deg" in table:
            table["north_m"], table["east_m"] = plane.place(table["lat_deg"], table["lon_deg"])
        if "ref_lat_deg" in table:  # a local position about a point of its own
            north, east = plane.place(table["ref_lat_deg"], table["ref_lon_deg"])
            table["north_m"], table["east_m"] = table["x_m"] + north, table["y_m"] + east


def angles(q):
    """Roll, pitch and yaw of quaternions (w, x, y, z) as columns."""
    w, x, y, z = q
    return {"roll_rad": np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            "pitch_rad": np.arcsin(np.clip(2 * (w * y - z * x), -1, 1)),
            "yaw_rad": np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))}


def present(table):
    """Without columns that hold nothing."""
    return {name: np.asarray(column) for name, column in table.items()
            if column is not None and not np.all(np.isnan(np.asarray(column, dtype=float)))}
