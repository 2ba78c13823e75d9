"""pflight: the particle filter of a flight computer, compiled from the firmware's own sources, for tuning in Python.

The same configuration, seed and calls give the same bits here as in C on any machine. Names are those of the C headers
(pflight/filter.h is the manual); `Filter.c_config` prints the C that belongs to a filter.
"""
from importlib.metadata import version as _version

from . import replay
from ._filter import Error, Estimate, Filter, Flight, Status, hash_estimates, self_test
from ._parts import (Draw, Model, Sensor, Structure, gaussian, model, models, python_draw, python_model, python_sensor, sensor,
                     sensors)

__all__ = ["Draw", "Error", "Estimate", "Filter", "Flight", "Model", "Sensor", "Status", "Structure", "gaussian", "hash_estimates",
           "model", "models", "python_draw", "python_model", "python_sensor", "replay", "self_test", "sensor", "sensors"]
__version__ = _version("pflight")
