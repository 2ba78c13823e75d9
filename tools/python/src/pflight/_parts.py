"""Models, sensors and priors: the ready ones of the library by their C names, and ones written in Python."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from ._pflight import ffi, lib

Array = npt.NDArray[np.float32]
Value = Union[float, int, str, "Structure", Sequence[float], Sequence[int], "npt.NDArray[Any]"]
# x: states (D, n) of a batch, to be changed or read; w: standard normals (Q, n); u, z: what the caller handed over.
PredictFunction = Callable[[Array, Array, float, Any], None]
LoglikFunction = Callable[[Array, Any], "npt.ArrayLike"]
DrawFunction = Callable[[Array, Array], None]

# ---- Structures of the library ------------------------------------------------------------------------------------------


def _fields(c_type: str) -> dict[str, Any]:
    return dict(ffi.typeof(c_type).fields or [])


def _settle(structure: Any, name: str, kind: Any, value: Value, kept: list[Any]) -> None:
    if kind.kind == "array":
        given = list(np.atleast_1d(np.asarray(value)).tolist())
        if len(given) > kind.length:
            raise ValueError(f"{name}: at most {kind.length} values, not {len(given)}")
        for k, one in enumerate(given):
            getattr(structure, name)[k] = one
    elif kind.kind == "pointer" and isinstance(value, Structure):
        kept.append(value)
        setattr(structure, name, value.c)
    elif kind.kind in ("pointer", "function") and isinstance(value, str):  # a function of the library
        setattr(structure, name, ffi.addressof(lib, value))
    else:
        setattr(structure, name, value)


class Structure:
    """A structure of the library (`pfl_..._t`) by its field names. A field inv_sigma may be given as sigma."""

    def __init__(self, c_type: str, values: Mapping[str, Value]) -> None:
        self.c_type = c_type
        self.c = ffi.new(c_type + " *")
        self.values: dict[str, Value] = {}
        self._kept: list[Any] = []
        known = _fields(c_type)
        for name, value in values.items():
            if name not in known and "inv_" + name in known:
                # As C computes it: the reciprocal in single precision.
                name, value = "inv_" + name, (np.float32(1.0) / np.asarray(value, dtype=np.float32))
            if name not in known:
                raise ValueError(f"{c_type} has no field '{name}'; its fields are: {', '.join(known)}")
            _settle(self.c, name, known[name].type, value, self._kept)
            self.values[name] = value

    def c_source(self) -> str:
        """The initialiser of this structure in C."""
        return "{" + ", ".join(f".{name} = {_literal(value)}" for name, value in self.values.items()) + "}"


def _literal(value: Any) -> str:
    if isinstance(value, Structure):
        return f"&({value.c_type}){value.c_source()}"
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple, np.ndarray)) and np.ndim(value) > 0:
        return "{" + ", ".join(_literal(one) for one in value) + "}"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    return float_literal(float(value))


def float_literal(value: float) -> str:
    """Nine digits tell any two single-precision numbers apart."""
    if np.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    text = np.format_float_positional(np.float32(value), unique=True, trim="0")
    if len(text) > 14:
        text = np.format_float_scientific(np.float32(value), unique=True, trim="0")
    return text + "f"


# ---- What a filter is made of ---------------------------------------------------------------------------------------------


@dataclass
class Model:
    """x <- f(x, u, w, dt): of the library, or a function in Python."""
    name: str
    states: int
    noises: int
    function: Any
    structure: Structure | None = None
    input_type: str | None = None  # of u
    python: PredictFunction | None = None


@dataclass
class Sensor:
    """log p(z | x), 0 for a perfect match."""
    name: str
    function: Any
    structure: Structure | None = None
    z_type: str | None = None  # of z; None: floats
    python: LoglikFunction | None = None
    gate: float = 0.0  # refuse when -2 max log-likelihood is above; 0: never


@dataclass
class Draw:
    """The prior."""
    function: Any
    structure: Any = None
    python: DrawFunction | None = None
    mean: Array = field(default_factory=lambda: np.zeros(0, np.float32))
    sigma: Array = field(default_factory=lambda: np.zeros(0, np.float32))


# ---- Ready ones -------------------------------------------------------------------------------------------------------------

# Name: structure, states, noises, structure of u. Counts that depend on the parameters are functions of them.
_Count = Union[int, Callable[[Any], int]]
_MODELS: dict[str, tuple[str, _Count, _Count, str | None]] = {
    "land_vehicle": ("pfl_land_vehicle_t", 4, 2, "pfl_land_input_t"),
    "land_vehicle_jitter": ("pfl_land_vehicle_t", 4, 4, "pfl_land_input_t"),
    "constant_velocity": ("pfl_constant_velocity_t", 4, lambda c: 4 if c.sigma_position > 0 else 2, None),
    "odometry": ("pfl_odometry_t", 3, 4, "pfl_odometry_input_t"),
    "wheels": ("pfl_wheels_t", 5, 6, "pfl_odometry_input_t"),
    "road_target": ("pfl_road_target_t", 4, 2, None),
    "lane_target": ("pfl_lane_target_t", 3, 2, None),
    "planar_uav": ("pfl_planar_uav_t", 5, lambda c: 2 if c.sigma_speed > 0 or c.sigma_turn > 0 else 0,
                   "pfl_planar_uav_input_t"),
    "autopilot": ("pfl_autopilot_t", lambda c: 6 + (2 if c.wind_state else 0) + (1 if c.waypoint_state else 0),
                  lambda c: 4 if c.wind_state else 2, "pfl_autopilot_input_t"),
    "coast": ("pfl_coast_t", lambda c: c.axes * (3 if c.remember else 2), 0, None),
    "turn": ("pfl_turn_t", lambda c: 7 if c.remember else 5, lambda c: 4 if c.redraw_hz > 0 else 2, None),
    "hover": ("pfl_hover_t", lambda c: 2 * c.axes + c.biases, lambda c: c.axes + c.biases, None),
}
_MODELS = {name: entry for name, entry in _MODELS.items() if hasattr(lib, f"pfl_{name}_predict")}  # an older library
_SENSORS: dict[str, tuple[str, str | None]] = {
    "position": ("pfl_position_t", None),
    "position_distance": ("pfl_position_t", None),
    "range": ("pfl_range_t", "pfl_range_z_t"),
    "range_bearing": ("pfl_range_bearing_t", "pfl_range_bearing_z_t"),
    "coloured": ("pfl_coloured_t", "pfl_coloured_z_t"),
    "velocity": ("pfl_velocity_t", None),
    "biased": ("pfl_biased_t", None),
    "scalar": ("pfl_scalar_t", None),
    "ranging": ("pfl_ranging_t", "pfl_range_z_t"),
}


def models() -> dict[str, list[str]]:
    """The ready models and the fields of their parameters; pflight/models.h says what they mean."""
    return {name: list(_fields(entry[0])) for name, entry in _MODELS.items()}


def sensors() -> dict[str, list[str]]:
    """The ready sensors and the fields of their parameters; pflight/sensors.h and errors.h say what they mean."""
    return {name: list(_fields(entry[0])) for name, entry in _SENSORS.items()}


def model(name: str, *, states: int | None = None, **fields: Value) -> Model:
    """A ready model, `pfl_<name>_predict`. states: more than it needs, where a filter has states of its own."""
    if name not in _MODELS:
        raise ValueError(f"no model '{name}'; the models are: {', '.join(_MODELS)}")
    c_type, own, noises, input_type = _MODELS[name]
    structure = Structure(c_type, fields)
    needed = own if isinstance(own, int) else own(structure.c)
    if states is not None and states < needed:
        raise ValueError(f"{name} needs {needed} states")
    return Model(f"pfl_{name}_predict", states or needed, noises if isinstance(noises, int) else noises(structure.c),
                 ffi.addressof(lib, f"pfl_{name}_predict"), structure, input_type)


def sensor(name: str, *, gate: float = 0.0, **fields: Value) -> Sensor:
    """A ready sensor, `pfl_<name>_loglik`. Its count, where it has one, is that of its states."""
    if name not in _SENSORS:
        raise ValueError(f"no sensor '{name}'; the sensors are: {', '.join(_SENSORS)}")
    c_type, z_type = _SENSORS[name]
    if "count" in _fields(c_type) and "count" not in fields:
        fields = {"count": int(np.size(np.asarray(fields.get("state", [])))), **fields}
    return Sensor(f"pfl_{name}_loglik", ffi.addressof(lib, f"pfl_{name}_loglik"), Structure(c_type, fields), z_type,
                  gate=gate)


def gaussian(mean: npt.ArrayLike, sigma: npt.ArrayLike) -> Draw:
    """A Gaussian prior, each state by itself."""
    m = np.atleast_1d(np.asarray(mean, dtype=np.float32))
    s = np.atleast_1d(np.asarray(sigma, dtype=np.float32))
    if m.shape != s.shape or m.ndim != 1:
        raise ValueError("mean and sigma: as many of one as of the other")
    prior = ffi.new("pflight_gaussian_t *", {"states": m.size, "mean": m.tolist(), "sigma": s.tolist()})
    return Draw(ffi.addressof(lib, "pflight_gaussian_draw"), prior, mean=m, sigma=s)


# ---- In Python ----------------------------------------------------------------------------------------------------------------


def python_model(function: PredictFunction, states: int, noises: int) -> Model:
    """A model as a function of a batch: function(x, w, dt_s, u) changes x, (states, n), in place."""
    return Model(function.__name__, states, noises, ffi.addressof(lib, "pflight_py_predict"), python=function)


def python_sensor(function: LoglikFunction, *, gate: float = 0.0) -> Sensor:
    """A sensor as a function of a batch: function(x, z) returns n log-likelihoods, 0 for a perfect match."""
    return Sensor(function.__name__, ffi.addressof(lib, "pflight_py_loglik"), python=function, gate=gate)


def python_draw(function: DrawFunction) -> Draw:
    """A prior as a function of a batch: function(x, w) sets x from as many normals, both (states, n)."""
    return Draw(ffi.addressof(lib, "pflight_py_draw"), python=function)
