"""A filter: the calls of pflight/filter.h with numpy arrays in and out."""
from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._parts import Array, Draw, Model, Sensor, float_literal
from ._pflight import ffi, lib

HASH_START = 0xCBF29CE484222325


class Status(enum.IntEnum):
    """pfl_status_t: positive done with something to know, negative refused."""
    OK = 0
    DEFERRED = 1
    QUARANTINED = 2
    REJECTED = -1
    ERR_ARG = -2
    ERR_MEMORY = -3
    ERR_CONFIG = -4
    ERR_ABI = -5
    ERR_TIME = -6
    ERR_GAP = -7
    ERR_SENSOR = -8
    ERR_NONFINITE = -9
    ERR_LOGLIK = -10
    ERR_BUDGET = -11
    ERR_BUSY = -12
    ERR_CORRUPT = -13
    ERR_SELF_TEST = -14
    ERR_NO_DRAW = -15


class Error(RuntimeError):
    """A call that the library refused; `status` says why."""

    def __init__(self, call: str, status: Status) -> None:
        super().__init__(f"{call}: {ffi.string(lib.pfl_status_string(int(status))).decode()} ({status.name})")
        self.status = status


@dataclass
class Estimate:
    mean: Array  # (D,)
    cov: Array  # (D, D)


@dataclass
class Flight:
    """What Filter.run leaves of each measurement."""
    mean: Array  # (T, D)
    cov: Array  # (T, D, D)
    ess: Array  # (T,), effective sample size
    status: npt.NDArray[np.int32]  # (T,), of the update
    hash: int  # over the means, as tools/run prints it


def self_test() -> None:
    """Raises Error when this build does not compute the library's known answers."""
    # An array of uint64_t is aligned to 8; twice the arena of such a filter holds the test's configuration too.
    room = ffi.new("uint64_t[]", 4096)
    _check("pfl_self_test", lib.pfl_self_test(room, 8 * 4096))


def hash_estimates(means: npt.ArrayLike, start: int = HASH_START) -> int:
    """The hash that tools/run prints: 64-bit FNV-1a over the bits of single-precision numbers."""
    x = np.ascontiguousarray(means, dtype=np.float32)
    return int(lib.pflight_hash_floats(start, ffi.cast("const float *", ffi.from_buffer(x)), x.size))


def _check(call: str, code: int) -> Status:
    status = Status(code)
    if status < 0 and status != Status.REJECTED:
        raise Error(call, status)
    return status


# ---- Callbacks into Python. What one raises is kept, and the filter sees NaN, which it refuses. --------------------------


class _Calls:
    """The Python functions of one filter, and what the call in hand gave them."""

    def __init__(self) -> None:
        self.model: Model | None = None
        self.draw: Draw | None = None
        self.u: Any = None
        self.z: Any = None
        self.states = 0
        self.noises = 0
        self.error: BaseException | None = None


class _Seen:
    """A sensor in Python, with the filter's calls."""

    def __init__(self, calls: _Calls, sensor: Sensor) -> None:
        self.calls = calls
        self.sensor = sensor


def _columns(pointer: Any, stride: int, rows: int, n: int) -> Array:
    flat = np.frombuffer(ffi.buffer(pointer, 4 * ((rows - 1) * stride + n)), dtype=np.float32)
    return np.lib.stride_tricks.as_strided(flat, shape=(rows, n), strides=(4 * stride, 4))


def _normals(p: Any, rows: int) -> Array:
    return _columns(p.noise, int(lib.PFL_BATCH), rows, p.n) if rows else np.zeros((0, p.n), np.float32)


@ffi.def_extern()
def pflight_py_predict(user: Any, _u: Any, dt_s: float, p: Any) -> None:
    calls: _Calls = ffi.from_handle(user)
    x = _columns(p.x, p.stride, calls.states, p.n)
    try:
        assert calls.model is not None and calls.model.python is not None
        calls.model.python(x, _normals(p, calls.noises), dt_s, calls.u)
    except BaseException as error:  # noqa: BLE001 -- C cannot carry it
        calls.error = error
        x[:] = np.nan


@ffi.def_extern()
def pflight_py_draw(user: Any, p: Any) -> None:
    calls: _Calls = ffi.from_handle(user)
    x = _columns(p.x, p.stride, calls.states, p.n)
    try:
        assert calls.draw is not None and calls.draw.python is not None
        calls.draw.python(x, _normals(p, calls.states))
    except BaseException as error:  # noqa: BLE001
        calls.error = error
        x[:] = np.nan


@ffi.def_extern()
def pflight_py_loglik(user: Any, _z: Any, p: Any, ll: Any) -> None:
    seen: _Seen = ffi.from_handle(user)
    out = np.frombuffer(ffi.buffer(ll, 4 * p.n), dtype=np.float32)
    x = _columns(p.x, p.stride, seen.calls.states, p.n)
    x.flags.writeable = False
    try:
        assert seen.sensor.python is not None
        out[:] = seen.sensor.python(x, seen.calls.z)
    except BaseException as error:  # noqa: BLE001
        seen.calls.error = error
        out[:] = np.nan


# ---- The filter ------------------------------------------------------------------------------------------------------------


class Filter:
    """A particle filter. Arguments are those of pfl_config_t; `draw` is the prior, without one all particles start at 0.

    `arena_bytes` is the memory that this filter takes on any machine; `c_config` prints its configuration in C.
    """

    def __init__(self, model: Model, sensors: Sequence[Sensor], *, particles: int, draw: Draw | None = None,
                 ess_ratio: float = 0.5, seed: int = 1, circular: Sequence[int] = (), resampling: str = "systematic",
                 kernel_width: float = 0.0, dt_max_us: int = 0, box: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
                 t_us: int = 0) -> None:
        self.model, self.sensors, self.draw = model, list(sensors), draw
        self.particles, self.states = particles, model.states
        self._calls = _Calls()
        self._calls.model, self._calls.draw = model, draw
        self._calls.states, self._calls.noises = model.states, model.noises
        self._kept: list[Any] = []
        self.config = self._keep(ffi.new("pfl_config_t *"))
        c = self.config
        c.abi, c.particles, c.states, c.noises = lib.PFL_ABI, particles, model.states, model.noises
        c.sensor_count, c.ess_ratio, c.seed, c.dt_max_us = len(self.sensors), ess_ratio, seed, dt_max_us
        c.resampling = ffi.addressof(lib, f"pfl_{resampling}")
        for state in circular:
            c.circular_mask |= 1 << state
            c.circular = ffi.addressof(lib, "pfl_circular_means")
        if kernel_width > 0.0:
            c.kernel = self._keep(ffi.new("pfl_kernel_t *", {"width": kernel_width,
                                                             "move": ffi.addressof(lib, "pfl_kernel_move")}))
        if box is not None:
            c.lo, c.hi = (self._floats(np.broadcast_to(np.asarray(side, np.float32), (model.states,))) for side in box)
        self._wire()
        self.arena_bytes = int(lib.pfl_arena_bytes(c))
        self._arena = ffi.new("uint64_t[]", (self.arena_bytes + 7) // 8 or 1)
        out = ffi.new("pfl_t **")
        self._done("pfl_init", lib.pfl_init(self._arena, self.arena_bytes, c, t_us, out))
        self._f = out[0]

    def _keep(self, c: Any) -> Any:
        self._kept.append(c)
        return c

    def _floats(self, values: npt.ArrayLike) -> Any:
        return self._keep(ffi.new("float[]", np.asarray(values, np.float32).tolist()))

    def _wire(self) -> None:
        """Model, prior and sensors into the configuration, each with a `user` of its own."""
        c, handle = self.config, self._keep(ffi.new_handle(self._calls))
        motion = self._keep(ffi.new("pflight_motion_t *"))
        motion.predict = self.model.function
        motion.user = self.model.structure.c if self.model.structure else handle
        self._motion, self._handle = motion, handle
        if self.draw is not None:
            self._set_draw()
            c.draw = ffi.addressof(lib, "pflight_motion_draw")
        c.predict, c.user = ffi.addressof(lib, "pflight_motion_predict"), motion
        table = self._keep(ffi.new("pfl_sensor_t[]", max(1, len(self.sensors))))
        for k, sensor in enumerate(self.sensors):
            table[k].loglik, table[k].gate = sensor.function, sensor.gate
            table[k].user = (sensor.structure.c if sensor.structure
                             else self._keep(ffi.new_handle(self._keep(_Seen(self._calls, sensor)))))
        c.sensors = table if self.sensors else ffi.NULL

    def _set_draw(self) -> None:
        assert self.draw is not None
        self._motion.draw = self.draw.function
        self._motion.draw_user = self.draw.structure if self.draw.structure is not None else self._handle

    def _done(self, call: str, code: int) -> Status:
        error, self._calls.error = self._calls.error, None
        if error is not None:
            raise error
        return _check(call, code)

    # ---- A filter cycle

    def predict(self, t_us: int, u: Any = None) -> Status:
        """Moves every particle to t_us. u: for a ready model a dict or sequence of its input's fields."""
        self._calls.u = u
        c_u = ffi.NULL
        if u is not None and self.model.input_type:
            c_u = ffi.new(self.model.input_type + " *", u if isinstance(u, dict) else list(u))
        return self._done("pfl_predict", lib.pfl_predict(self._f, t_us, c_u))

    def update(self, sensor: int, t_us: int, z: Any) -> Status:
        """Fuses a measurement at the filter's time. REJECTED is an answer, not an error."""
        self._calls.z = z
        if not 0 <= sensor < len(self.sensors):
            raise Error("pfl_update", Status.ERR_SENSOR)
        kind = self.sensors[sensor]
        if kind.python is not None:
            c_z = ffi.new("float *")  # never looked at
        elif kind.z_type is None:
            c_z = ffi.new("float[]", np.atleast_1d(np.asarray(z, np.float32)).tolist())
        else:
            c_z = ffi.new(kind.z_type + " *", z if isinstance(z, dict) else list(z))
        return self._done("pfl_update", lib.pfl_update(self._f, sensor, t_us, c_z))

    def estimate(self) -> Estimate:
        mean, cov = np.zeros(self.states, np.float32), np.zeros((self.states, self.states), np.float32)
        self._done("pfl_estimate", lib.pfl_estimate(self._f, _float_pointer(mean), _float_pointer(cov)))
        return Estimate(mean, cov)

    def run(self, t_us: Sequence[int] | npt.NDArray[np.integer[Any]], sensor: int | Sequence[int], z: Sequence[Any] | npt.NDArray[Any],
            u: Sequence[Any] | None = None) -> Flight:
        """A filter cycle for each measurement: predict, update, estimate. u[k] holds over the step to t_us[k]."""
        count = len(t_us)
        which = [sensor] * count if isinstance(sensor, int) else list(sensor)
        flight = Flight(np.zeros((count, self.states), np.float32),
                        np.zeros((count, self.states, self.states), np.float32), np.zeros(count, np.float32),
                        np.zeros(count, np.int32), HASH_START)
        for k in range(count):
            self.predict(int(t_us[k]), u[k] if u is not None else None)
            flight.status[k] = self.update(which[k], int(t_us[k]), z[k])
            now = self.estimate()
            flight.mean[k], flight.cov[k], flight.ess[k] = now.mean, now.cov, self.ess
        flight.hash = hash_estimates(flight.mean)
        return flight

    # ---- Answers

    @property
    def ess(self) -> float:
        """Effective sample size of the last update, before its resampling."""
        return float(lib.pfl_effective_sample_size(self._f))

    def cloud(self) -> tuple[Array, Array]:
        """Copies of the particles (D, N) and of their log-weights (N,)."""
        view = ffi.new("pfl_view_t *")
        weights = np.zeros(self.particles, np.float32)
        self._done("pfl_particles", lib.pfl_particles(self._f, view, _float_pointer(weights)))
        return _columns(view.x, view.stride, self.states, view.n).copy(), weights

    def most_likely(self) -> Array:
        state = np.zeros(self.states, np.float32)
        self._done("pfl_most_likely", lib.pfl_most_likely(self._f, _float_pointer(state)))
        return state

    def quantile(self, state: int, p: float) -> float:
        value = ffi.new("float *")
        self._done("pfl_quantile", lib.pfl_quantile(self._f, state, p, value))
        return float(value[0])

    def health(self) -> dict[str, float | int | bool]:
        """pfl_health_t by its fields; pflight/health.h says what each means."""
        h = ffi.new("pfl_health_t *")
        self._done("pfl_health", lib.pfl_health(self._f, h))
        return {name: getattr(h, name) for name, _ in ffi.typeof("pfl_health_t").fields}

    def forecast(self, step_us: int, steps: int) -> tuple[Array, Array]:
        """Pure prediction to a horizon, without touching the filter: means (steps, D), covariances (steps, D, D)."""
        room = ffi.new("uint64_t[]", (self.arena_bytes + 7) // 8)
        mean = np.zeros((steps, self.states), np.float32)
        cov = np.zeros((steps, self.states, self.states), np.float32)
        horizon = ffi.new("pfl_horizon_t *", {"step_us": step_us, "steps": steps})
        self._calls.u = None
        self._done("pfl_forecast", lib.pfl_forecast(self._f, room, self.arena_bytes, horizon, _float_pointer(mean),
                                                    _float_pointer(cov), ffi.NULL))
        return mean, cov

    # ---- Keeping

    def reset(self, t_us: int, draw: Draw | None = None) -> Status:
        """Begins anew from the prior; `draw` is another one, from now on."""
        if draw is not None:
            self.draw = self._calls.draw = draw
            self._set_draw()
        return self._done("pfl_reset", lib.pfl_reset(self._f, t_us))

    def resample(self) -> Status:
        return self._done("pfl_resample", lib.pfl_resample(self._f))

    def snapshot(self) -> bytes:
        """Everything that a later run needs to go on with the same bits, here or on the flight computer."""
        buffer = bytearray(int(lib.pfl_snapshot_bytes(self._f)))
        self._done("pfl_snapshot", lib.pfl_snapshot(self._f, ffi.from_buffer(buffer), len(buffer)))
        return bytes(buffer)

    def restore(self, snapshot: bytes) -> Status:
        return self._done("pfl_restore", lib.pfl_restore(self._f, ffi.from_buffer(snapshot), len(snapshot)))

    # ---- For the firmware

    def c_config(self, name: str = "filter") -> str:
        """The configuration in C, to paste. What is written in Python is named, and left to be written in C."""
        c, lines = self.config, []
        user = None
        if self.model.structure is not None:
            user = f"{name}_motion"
            lines.append(f"static const {self.model.structure.c_type} {user} = {self.model.structure.c_source()};")
        else:
            lines.append(f"/* to be written in C: the model {self.model.name} */")
        for k, sensor in enumerate(self.sensors):
            if sensor.structure is not None:
                lines.append(f"static const {sensor.structure.c_type} {name}_sensor_{k} = {sensor.structure.c_source()};")
        lines.append(f"static const pfl_sensor_t {name}_sensors[] = {{")
        for k, sensor in enumerate(self.sensors):
            given = f", .user = (void *)&{name}_sensor_{k}" if sensor.structure is not None else ""
            gate = f", .gate = {float_literal(sensor.gate)}" if sensor.gate > 0.0 else ""
            lines.append(f"    {{.loglik = {sensor.name}{given}{gate}}},")
        lines.append("};")
        lines += self._c_draw(name)
        lines += [f"static const pfl_config_t {name}_config = {{", "    .abi = PFL_ABI,",
                  f"    .particles = {c.particles}, .states = {c.states}, .noises = {c.noises},",
                  f"    .sensor_count = {c.sensor_count}, .sensors = {name}_sensors,",
                  f"    .ess_ratio = {float_literal(c.ess_ratio)}, .seed = {c.seed},"]
        if c.circular_mask:
            lines.append(f"    .circular_mask = {c.circular_mask:#x}, .circular = pfl_circular_means,")
        if c.dt_max_us:
            lines.append(f"    .dt_max_us = {c.dt_max_us},")
        lines.append(f"    .predict = {self.model.name}," + (f" .user = (void *)&{user}," if user else ""))
        if self.draw is not None:
            lines.append(f"    .draw = {name}_draw,")
        lines += ["};", f"PFL_ARENA({name}_arena, {c.particles}, {c.states}, {c.noises}); /* {self.arena_bytes} B */"]
        return "\n".join(lines) + "\n"

    def _c_draw(self, name: str) -> list[str]:
        if self.draw is None:
            return []
        if self.draw.mean.size == 0:
            return [f"/* to be written in C: the prior {name}_draw */"]
        mean = ", ".join(float_literal(x) for x in self.draw.mean)
        sigma = ", ".join(float_literal(x) for x in self.draw.sigma)
        return [f"static void {name}_draw(void *user, const pfl_batch_t *p)", "{",
                f"    static const float mean[] = {{{mean}}};", f"    static const float sigma[] = {{{sigma}}};",
                "    (void)user;", f"    for (uint32_t d = 0u; d < {self.draw.mean.size}u; d++) {{",
                "        for (uint32_t i = 0u; i < p->n; i++) {",
                "            PFL_STATE(p, d)[i] = mean[d] + sigma[d] * PFL_NOISE(p, d)[i];",
                "        }", "    }", "}"]


def _float_pointer(x: Array) -> Any:
    return ffi.cast("float *", ffi.from_buffer(x))
