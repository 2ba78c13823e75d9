"""Flies a log, in the columns that tools/log writes, as the scenario `replay` of tools/run does: the same filter, the same
calls, the same bits. tools/runner/replay*.c is the same in C: change both.
"""
from __future__ import annotations

import csv
import math
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._filter import HASH_START, Filter, hash_estimates
from ._parts import Array, Draw, Model, Sensor, gaussian, model, python_draw, sensor
from ._pflight import ffi, lib

UNBIASED = 0xFFFF
# Sensors in their order, with file, columns, standard deviation.
_SOURCES: dict[str, tuple[str, tuple[str, ...], str]] = {
    "gps": ("gps.csv", ("north_m", "east_m"), "sigma_gps"),
    "fix": ("gnss_fix.csv", ("north_m", "east_m"), "sigma_gps"),
    "velocity": ("gps.csv", ("vn_mps", "ve_mps"), "sigma_velocity"),
    "height": ("gps.csv", ("alt_msl_m",), "sigma_height"),
    "baro": ("baro.csv", ("baro_alt_m",), "sigma_baro"),
    "range": ("ranges.csv", ("anchor_id", "range_m"), "sigma_range"),
}
_SENSOR_SIGMAS = {"sigma_gps": 1.5, "sigma_velocity": 0.3, "sigma_height": 3.0, "sigma_baro": 0.5, "sigma_range": 0.2}
_MOTION = {"cv": 2.0, "hover": 3.0, "turn": 2.0, "odometry": 0.1}
_TURNING = {"cv": 0.0, "hover": 0.0, "turn": 0.2, "odometry": 0.05}


@dataclass
class Event:
    t_s: float
    t_us: int
    sensor: str
    z: list[float]  # of a range the fields of pfl_range_z_t
    odometry: tuple[float, float] = (0.0, 0.0)


@dataclass
class Replay:
    filter: Filter
    t_s: npt.NDArray[np.float64]  # (T,), of the log
    sensor: list[str]
    mean: Array  # (T, D), after each measurement
    cov: Array  # (T, D, D)
    innovation: npt.NDArray[np.float64]  # (T, 2), position measured less predicted; NaN for other sensors
    nis: npt.NDArray[np.float64]  # (T,), its square over its covariance: 2 on average for a consistent filter
    loglik: npt.NDArray[np.float64]  # (T,), of the measured position as predicted: the larger, the better the noises
    hash: int  # of tools/run replay --runs 1, bit for bit

    def mean_loglik(self, from_s: float = 10.0) -> float:
        late = self.t_s - self.t_s[0] >= from_s
        return float(np.nanmean(self.loglik[late]))

    def mean_nis(self, from_s: float = 10.0) -> float:
        late = self.t_s - self.t_s[0] >= from_s
        return float(np.nanmean(self.nis[late]))


def _read(folder: pathlib.Path, name: str, columns: Sequence[str], what: str) -> npt.NDArray[np.float64]:
    """Columns of a file, NaN where a cell is empty."""
    try:
        with open(folder / name, newline="") as file:
            rows = list(csv.DictReader(file))
        return np.array([[float(row[c] or "nan") for c in columns] for row in rows])
    except (OSError, KeyError) as error:
        raise ValueError(f"{what} needs {folder / name} with the columns {', '.join(columns)}: {error!r}") from error


def events(folder: str | pathlib.Path, sensors: Sequence[str], swapped: bool = False) -> list[Event]:
    """A log as one list of measurements in the order of time. swapped: east before north."""
    folder, found = pathlib.Path(folder), []
    unknown = set(sensors) - set(_SOURCES)
    if unknown:
        raise ValueError(f"no sensor {', '.join(sorted(unknown))}; the sensors are: {', '.join(_SOURCES)}")
    for order, (name, (file, columns, _)) in enumerate(_SOURCES.items()):
        if name not in sensors:
            continue
        for row in _read(folder, file, ("t_s", *columns), f"the sensor {name}"):
            if not np.any(np.isnan(row)):
                z = [float(number) for number in row[1:]]
                found.append((float(row[0]), order, Event(float(row[0]), 0, name, z[::-1] if swapped and name != "range" else z)))
    found.sort(key=lambda entry: entry[:2])
    for _, _, event in found:
        event.t_us = math.floor((event.t_s - found[0][0]) * 1e6 + 0.5)
    return [event for _, _, event in found]


def _first(log: Sequence[Event], name: str) -> Event | None:
    return next((event for event in log if event.sensor == name), None)


def _begins_anew(log: Sequence[Event], k: int, gap_s: float) -> bool:
    """Is this event behind a gap, and does what follows tell a position?"""
    if k == 0 or gap_s <= 0.0 or log[k].t_s - log[k - 1].t_s < gap_s:
        return False
    position = next(name for name in ("gps", "fix", "range") if _first(log, name))
    return _first(log[k:], position) is not None


def _f(x: float) -> Any:
    return np.float32(x)


def _prior(kind: str, log: Sequence[Event], sigma: dict[str, float], start_speed: float) -> Draw:
    position, first_range = _first(log, "gps") or _first(log, "fix"), _first(log, "range")
    velocity = _first(log, "velocity")
    if position is not None:
        mean, spread = list(position.z), [sigma[position.sensor]] * 2
    elif first_range is not None:
        mean, spread = first_range.z[:2], [sigma["range"]] * 2
    else:
        raise ValueError("one of the sensors must tell the position: gps, fix or range")
    v, v_sigma = (velocity.z, sigma["velocity"]) if velocity else ([0.0, 0.0], start_speed)
    if kind == "cv":
        mean, spread = mean + v, spread + [v_sigma] * 2
    elif kind == "hover":
        height, baro = _first(log, "height"), _first(log, "baro")
        any_height = height or baro
        both = height is not None and baro is not None
        bias = float(_f(baro.z[0]) - _f(height.z[0])) if height and baro else 0.0
        mean = mean + [any_height.z[0] if any_height else 0.0] + v + [0.0, bias]
        spread = (spread + [sigma[any_height.sensor] if any_height else 0.0] + [v_sigma] * 2 +
                  [1.0, sigma["height"] if both else 0.0])
    elif kind == "turn":
        a, b = _f(v[0]), _f(v[1])
        speed = lib.pfl_sqrtf(float(a * a + b * b)) if velocity else 0.0
        heading = lib.pfl_atan2f(float(b), float(a)) if velocity else 0.0
        course = _f(speed) > _f(5.0) * _f(sigma["velocity"])
        mean, spread = mean + [speed, heading, 0.0], spread + [v_sigma, 0.3 if course else 3.0, 0.2]
    else:
        mean, spread = mean + [0.0], spread + [3.0]
    if position is None and first_range is not None:
        return _ring(gaussian(mean, spread), first_range.z)
    return gaussian(mean, spread)


def _ring(prior: Draw, z: Sequence[float]) -> Draw:
    """Around the anchor of the first range, in any direction."""
    height, measured = _f(z[2]), _f(z[3])
    square = measured * measured - height * height
    radius = _f(lib.pfl_sqrtf(float(max(square, _f(0.0)))))
    sine, cosine = ffi.new("float *"), ffi.new("float *")

    def ring(x: Array, w: Array) -> None:
        x[:] = prior.mean[:, None] + prior.sigma[:, None] * w
        rho = radius + prior.sigma[0] * w[0]
        for i, wide in enumerate(_f(10.0) * w[1]):
            lib.pfl_sincosf(lib.pfl_wrap_pi(float(wide)), sine, cosine)
            x[0, i] = prior.mean[0] + rho[i] * _f(cosine[0])
            x[1, i] = prior.mean[1] + rho[i] * _f(sine[0])

    return python_draw(ring)


def _model(kind: str, motion: float, turning: float, both_heights: bool) -> tuple[Model, Sequence[int]]:
    if kind == "cv":
        return model("constant_velocity", sigma_accel=motion), ()
    if kind == "hover":
        return model("hover", axes=3, biases=1, time_s=5.0, sigma_mps=[motion] * 3,
                     bias_walk=[0.05 if both_heights else 0.0]), ()
    if kind == "turn":
        return model("turn", sigma_speed=motion, sigma_rate=turning), (3,)
    if kind == "odometry":
        return model("odometry", speed_scale=1.0, speed_share=motion, turn_share=motion, sigma_turn=turning,
                     sigma_position=0.1), (2,)
    raise ValueError(f"no model '{kind}'; the models are: {', '.join(_MOTION)}")


def _sensor(kind: str, name: str, sigma: float, gate: float, range_dof: float) -> Sensor:
    if name == "range":
        return sensor("range", x_state=0, y_state=1, sigma=sigma, dof=range_dof, gate=gate)
    if name == "baro":
        return sensor("biased", state=[2], bias=[6], sigma=[sigma], gate=gate)
    if name == "velocity" and kind == "turn":
        return sensor("velocity", speed_state=2, heading_state=3, sigma=sigma, gate=gate)
    first = {"velocity": 3 if kind == "hover" else 2, "height": 2}.get(name, 0)
    states = [first] if name == "height" else [first, first + 1]
    return sensor("position", state=states, sigma=[sigma] * len(states), gate=gate)


def _take_odometry(log: Sequence[Event], folder: pathlib.Path) -> None:
    """Each measurement gets the last speed and turn rate before it."""
    rows = _read(folder, "odometry.csv", ("t_s", "v_forward_mps", "yaw_rate_radps"), "the model odometry")
    at = np.clip(np.searchsorted(rows[:, 0], [event.t_s for event in log], side="right") - 1, 0, None)
    for event, k in zip(log, at):
        event.odometry = (float(rows[k, 1]), float(rows[k, 2]))


def _take_anchors(log: Sequence[Event], folder: pathlib.Path, over_m: float) -> None:
    """Ranges get their anchors."""
    rows = _read(folder, "anchors.csv", ("anchor_id", "x_m", "y_m"), "the sensor range").tolist()
    where = {round(row[0]): row[1:] for row in rows}
    for event in log:
        if event.sensor == "range":
            if round(event.z[0]) not in where:
                raise ValueError(f"{folder / 'ranges.csv'}: anchor {event.z[0]:g} is not in anchors.csv")
            event.z = [*where[round(event.z[0])], over_m, event.z[1], 1.0]


def _sigma_of(choices: dict[str, Any]) -> dict[str, float]:
    """Of each sensor."""
    return {name: choices.get(source[2], _SENSOR_SIGMAS[source[2]]) for name, source in _SOURCES.items()}


def build(folder: str | pathlib.Path, *, model: str = "cv", sensors: Sequence[str] = ("gps",), particles: int = 500,
          seed: int = 2, motion: float | None = None, turning: float | None = None, ess: float = 0.5, gate: float = 0.0,
          start_speed: float = 10.0, range_dof: float = 3.0, anchors_over: float = 0.0,
          **sigmas: float) -> tuple[Filter, list[Event]]:
    """The filter of `tools/run replay` and its log. sigmas: sigma_gps, sigma_velocity, sigma_height, sigma_baro,
    sigma_range."""
    wrong = set(sigmas) - set(_SENSOR_SIGMAS)
    if wrong:
        raise TypeError(f"unknown {', '.join(sorted(wrong))}; the deviations are: {', '.join(_SENSOR_SIGMAS)}")
    if model not in _MOTION:
        raise ValueError(f"no model '{model}'; the models are: {', '.join(_MOTION)}")
    sigma = _sigma_of(sigmas)
    log = events(folder, sensors, swapped=model == "odometry")
    if model == "odometry":
        _take_odometry(log, pathlib.Path(folder))
    if "range" in sensors:
        _take_anchors(log, pathlib.Path(folder), anchors_over)
    motion_model, circular = _model(model, _MOTION[model] if motion is None else motion,
                                    _TURNING[model] if turning is None else turning,
                                    {"height", "baro"} <= set(sensors))
    wanted = [name for name in _SOURCES if name in sensors]
    return Filter(motion_model, [_sensor(model, name, sigma[name], gate, range_dof) for name in wanted], particles=particles,
                  draw=_prior(model, log, sigma, start_speed), ess_ratio=ess, seed=seed, circular=circular), log


def _surprise(cov: Array, sigma: float, e: npt.NDArray[np.float64]) -> tuple[float, float]:
    """NIS and Gaussian log-likelihood of an innovation."""
    s = cov[:2, :2].astype(np.float64) + np.eye(2) * float(np.float32(sigma)) ** 2
    nis = float(e @ np.linalg.solve(s, e))
    return nis, -0.5 * (nis + math.log(float(np.linalg.det(s)))) - math.log(2.0 * math.pi)


def fly(folder: str | pathlib.Path, *, gap: float = 60.0, **choices: Any) -> Replay:
    """Flies the log; the choices are those of `build`. gap: behind so many seconds without a measurement it begins anew."""
    f, log = build(folder, **choices)
    sigma = _sigma_of(choices)
    wanted = [name for name in _SOURCES if name in choices.get("sensors", ("gps",))]
    count = len(log)
    out = Replay(f, np.array([event.t_s for event in log]), [event.sensor for event in log],
                 np.zeros((count, f.states), np.float32), np.zeros((count, f.states, f.states), np.float32),
                 np.full((count, 2), np.nan), np.full(count, np.nan), np.full(count, np.nan), HASH_START)
    for k, event in enumerate(log):
        if _begins_anew(log, k, gap):
            f.reset(event.t_us, _prior(choices.get("model", "cv"), log[k:], sigma, choices.get("start_speed", 10.0)))
        f.predict(event.t_us, event.odometry)
        if event.sensor in ("gps", "fix"):
            ahead = f.estimate()
            out.innovation[k] = np.asarray(event.z, np.float32).astype(np.float64) - ahead.mean[:2]
            out.nis[k], out.loglik[k] = _surprise(ahead.cov, sigma["gps"], out.innovation[k])
        f.update(wanted.index(event.sensor), event.t_us, event.z)
        now = f.estimate()
        out.mean[k], out.cov[k] = now.mean, now.cov
    out.hash = _study_hash(hash_estimates(out.mean))
    return out


def _study_hash(run: int) -> int:
    """tools/run hashes the runs' hashes once more; here there is one run."""
    value = HASH_START
    for byte in run.to_bytes(8, "little"):
        value = ((value ^ byte) * 0x100000001B3) % 2**64
    return value
