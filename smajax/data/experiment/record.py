"""Experiment: measured runs on uniform clocks, what is known, what is to be found. The record all later stages read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from smajax.data.experiment.schema import LogFormat
from smajax.data.readers.table import Array

# What a run may start with that no parameter of the model says: the name in the file -> the parameter, if it is one.
RUN_STARTS = MappingProxyType({"initial_temperature": "", "initial_martensite_fraction": "start_fraction"})


@dataclass(frozen=True)
class Prior:
    """A normal distribution of a parameter, or of its logarithm; sigma in the program's own unit, or of the logarithm."""

    mean: float
    sigma: float
    logarithmic: bool


@dataclass(frozen=True)
class PriorSpread:
    """What a file says of the prior of a value, program's own unit; None: as the library has it.

    logarithmic: whether `sigma` is of the natural logarithm.
    """

    base: float | None
    sigma: float | None
    logarithmic: bool


@dataclass(frozen=True)
class DeclaredPriors:
    """Priors of candidate effects and of the presets' values that the file gives in the place of the library's.

    odds: by effect. coefficients: by full name ("latent_heat.enthalpy"). presets: by parameter, about the presets' values where they have no
    base.
    """

    odds: dict[str, float] = field(default_factory=dict)
    coefficients: dict[str, PriorSpread] = field(default_factory=dict)
    presets: dict[str, PriorSpread] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.odds or self.coefficients or self.presets)


@dataclass(frozen=True)
class Unknown:
    """A parameter to be found, in the program's own unit (SI, degC, rad): low < high, low <= start <= high.

    per_run: each run has a value of its own; where `runs` names some, these alone, and in all others it is zero.
    `RUN_STARTS` holds the names that are no parameter's.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    per_run: bool = False
    prior: Prior | None = None
    runs: tuple[str, ...] | None = None

    def of(self, run: str) -> bool:
        """Whether that run has a value of its own."""
        return self.per_run and (self.runs is None or run in self.runs)


@dataclass(frozen=True)
class Output:
    """A sensor, in the program's own unit.

    noise_sigma: white measurement noise on the clock; noise_how: where that number is from; noise_given: by the file.
    offset: whether each run has an unknown zero of it. reading_sigma: of a single reading, where a sample on the clock averages several; else None.
    """

    name: str
    unit: str
    noise_sigma: float
    noise_how: str
    noise_given: bool
    offset: bool
    reading_sigma: float | None = None


@dataclass(frozen=True)
class Run:
    """One measured run on the experiment's clock.

    role: "fit" or "held-out". time (n,): seconds as measured, one step apart. inputs: channel -> (n,), each value
    holding for the step that begins at its time. outputs: sensor -> (n,) at those times, nan where a sample is missing.
    parameters: this run's own values, which go before the experiment's. files, sha256: what was read, and the digest of
    their bytes in order.
    """

    name: str
    role: str
    time: Array
    inputs: dict[str, Array]
    outputs: dict[str, Array]
    parameters: dict[str, float]
    files: tuple[Path, ...]
    sha256: str

    @property
    def output(self) -> Array:
        """The first sensor: the only one of most experiments."""
        return next(iter(self.outputs.values()))


@dataclass(frozen=True)
class FromModelFile:
    """What a base model has from a model file, beside the values that are known.

    values: of a fit or of presets, SI, effects' coefficients with them. errors: standard errors of the fitted ones that the runs
    determined. bounds: of all fitted ones. priors: of those of them that had one.
    """

    effects: tuple[str, ...]
    values: Mapping[str, float]
    errors: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]
    sha256: str
    fitted_to: Mapping[str, str] = field(default_factory=dict)  # digest of a run that it was fitted to -> its name
    warnings: tuple[str, ...] = ()
    priors: Mapping[str, Prior] = field(default_factory=dict)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Fitted ones that no run determined."""
        return tuple(name for name in self.bounds if name not in self.errors)


@dataclass(frozen=True)
class Experiment:
    """A validated experiment; every number is in the program's own units (SI, degC, rad).

    effects_only None: every effect is a candidate. warnings: what is allowed and looks wrong, one sentence each. fitted_presets: those of
    the unknowns that the file does not give, with priors in the place of the presets' values (`fit.uncertain_presets`).
    """

    name: str
    title: str
    path: Path
    wire: str
    load: str
    drive: str
    law: str  # of the kinetics; "": the wire's own
    parameters: dict[str, float]
    unknowns: tuple[Unknown, ...]
    step: float
    clocked: bool  # whether the samples have times; False: only their order is known, and a step is one sample
    outputs: tuple[Output, ...]
    effects_only: tuple[str, ...] | None
    effects_excluded: tuple[str, ...]
    runs: tuple[Run, ...]
    warnings: tuple[str, ...]
    log_format: LogFormat | None = None  # how the logs of its runs were read
    model_file: FromModelFile | None = None
    priors: DeclaredPriors = field(default_factory=DeclaredPriors)
    fitted_presets: tuple[str, ...] = ()

    @property
    def base_values(self) -> dict[str, float]:
        """Values of the base model that are not the presets': of a model file, of priors, known ones, and starts of unknown ones, SI."""
        shared = (unknown for unknown in self.unknowns if unknown.runs is None)
        starts = {unknown.name: unknown.start for unknown in shared if unknown.name not in RUN_STARTS}
        middles = {name: one.base for name, one in self.priors.presets.items() if one.base is not None}
        return {**(self.model_file.values if self.model_file else {}), **middles, **self.parameters, **starts}

    @property
    def offset(self) -> bool:
        """Whether each run has an unknown zero of some sensor."""
        return any(output.offset for output in self.outputs)

    @property
    def output_name(self) -> str:
        """Of the first output, as the three below: the only one of most experiments."""
        return self.outputs[0].name

    @property
    def output_unit(self) -> str:
        return self.outputs[0].unit

    @property
    def noise_sigma(self) -> float:
        return self.outputs[0].noise_sigma

    @property
    def noise_how(self) -> str:
        return self.outputs[0].noise_how

    @property
    def declared_effects(self) -> tuple[str, ...]:
        """Effects that the base model has already: those of its model file, and those of which a parameter is given or unknown."""
        named = [*self.parameters, *(unknown.name for unknown in self.unknowns)]
        own = self.model_file.effects if self.model_file else ()
        return tuple(dict.fromkeys((*own, *(name.split(".", 1)[0] for name in named if "." in name))))
