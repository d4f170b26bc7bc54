"""What the program can simulate, as far as an experiment file refers to it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from smajax.model.channels import INPUT_UNITS

WIRE_SIZES = ("wire_length", "wire_diameter")  # what a ruler tells of the wire; no preset's are those of another bench


@dataclass(frozen=True)
class ParameterInfo:
    """Unit of a parameter (the program's own: SI, degC, rad) and the widest values that make physical sense.

    preset: what the presets have for it; None of an effect, whose base value says only that it is not there. also: as `Parameter.also`.
    """

    unit: str
    low: float
    high: float
    preset: float | None = None
    also: str = ""


@dataclass(frozen=True)
class CoefficientInfo(ParameterInfo):
    """A coefficient of a candidate effect.

    switch: the effect is off where it is zero. logarithmic: the library's prior is of its logarithm. positive: the middle of that is above zero.
    """

    switch: bool = False
    logarithmic: bool = False
    positive: bool = False


@dataclass(frozen=True)
class Scale:
    """What magnitudes a model has at given values, by which measured ones are judged.

    wire_length: m. ambient: degC. time_constant: s, of the wire's temperature. warming: inputs (n,) -> the degrees above
    the air (n,) at which the wire comes to rest under each. own: the output that the load's own sensor shows, which rises with heat.
    resistance: ohm, of the whole wire, the least and the most of both phases; zero where it is not known. masses: kg, of the load, by their names.
    """

    wire_length: float
    ambient: float
    time_constant: float
    warming: Callable[[Mapping[str, NDArray[np.float64]]], NDArray[np.float64]]
    own: str = "position"
    resistance: tuple[float, float] = (0.0, 0.0)
    masses: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ModelDescription:
    """What one combination of wire, load and drive needs and gives.

    parameters: name -> unit and bounds. outputs: name of each quantity that can be compared with a sensor -> unit.
    input_units: input channel -> the program's own unit. inputs_sampled: inputs that are measured at an instant and
    vary smoothly, as an output is; every other input is a command that holds between its samples. inputs_squared: of
    those, the ones that act by their square (a voltage on a resistor). heats: inputs of the drive, that heat the wire.
    effects: those that can change anything of this combination; None: all. scale(values of parameters): its magnitudes.
    disorder(values): the names of two parameters that contradict each other, and how; None where none do.
    """

    parameters: Mapping[str, ParameterInfo]
    inputs_required: frozenset[str]
    inputs_optional: frozenset[str]
    outputs: Mapping[str, str]
    input_units: Mapping[str, str] = field(default_factory=lambda: INPUT_UNITS)
    inputs_sampled: frozenset[str] = frozenset()
    inputs_squared: frozenset[str] = frozenset()
    heats: frozenset[str] = frozenset()
    effects: frozenset[str] | None = None
    scale: Callable[[Mapping[str, float]], Scale] | None = None
    disorder: Callable[[Mapping[str, float]], tuple[str, str, str] | None] = lambda values: None


@dataclass(frozen=True)
class Catalogue:
    """Names that an experiment file may use, and the description of a combination of them.

    describe(wire, load, drive, law) raises ValueError when the three do not go together; law "" is the wire's own.
    coefficients(effect): those of one effect by their own names. odds: prior odds by class. groups: what effects describe that exclude
    each other, by their names.
    """

    wires: Collection[str]
    loads: Collection[str]
    drives: Collection[str]
    laws: Collection[str]
    effects: Collection[str]
    describe: Callable[[str, str, str, str], ModelDescription]
    coefficients: Callable[[str], Mapping[str, CoefficientInfo]] = lambda effect: {}
    odds: Mapping[str, float] = field(default_factory=dict)
    groups: Mapping[str, str] = field(default_factory=dict)
