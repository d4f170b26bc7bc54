"""Input channels that a load or a drive may have, with the unit of each (SI, temperatures in degrees Celsius), and states by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from smajax.core.display_units import Display, display

INPUT_UNITS: Mapping[str, str] = MappingProxyType(
    {
        "voltage": "V",
        "current": "A",
        "power": "W",
        "duty": "1",
        "mass": "kg",
        "load_torque": "N m",
        "added_mass": "kg",
        "temperature": "degC",
        "stress": "Pa",
        "strain": "1",
        "ambient_temperature": "degC",
    }
)

# Parameter -> the channel whose series stands in its place where a log has it.
REPLACED: Mapping[str, str] = MappingProxyType({"load_mass": "mass", "ambient_temperature": "ambient_temperature"})
# States of the wire that say how far a model was tested.
RANGED = ("temperature", "stress")
SHOWN = ("temperature", "martensite_fraction", "stress")  # of each run, beside its outputs

# The record keeps input channels and model states by name only.
_CHANNELS = {**INPUT_UNITS, "martensite_fraction": "1"}


def channel(name: str) -> Display:
    """How to show the input channel or model state `name`."""
    return display(_CHANNELS.get(name, "1"), name)
