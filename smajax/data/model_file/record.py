"""A fitted model that is kept: its parts by name, every parameter, what is known of them, and the runs that it was fitted to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import jax
import numpy as np

from smajax.core.correlation import correlation_of, deviations_of
from smajax.core.parameters import Parameter, parameter_values, parameters, set_parameters
from smajax.data.experiment.record import Prior
from smajax.data.experiment.schema import LogFormat
from smajax.model.channels import INPUT_UNITS
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.wire.order import ORDER

if TYPE_CHECKING:
    from collections.abc import Sequence

Origin = Literal["fitted", "given", "preset"]


ROUNDS = 200  # of draws, twice as many as asked for each
# Quantities of a fitted range beside the inputs -> unit.
STATE_UNITS = {"temperature": "degC", "stress": "Pa", "temperature_rate": "K/s"}


def range_unit(name: str, table: Mapping[str, Parameter]) -> str:
    """Unit of a quantity of a fitted range: a state of the wire, an input, or a parameter that runs have their own value of."""
    return STATE_UNITS.get(name) or INPUT_UNITS.get(name) or table[name].unit


@dataclass(frozen=True)
class ModelParameter:
    """One value, in the program's own unit (SI, degC, rad).

    origin: "fitted" to runs; "given" by the user; "preset": nobody gave it. low, high: the bounds of the fit, else what makes
    physical sense. standard_error: of a fitted one that the runs determine.
    """

    value: float
    origin: Origin
    low: float
    high: float
    standard_error: float | None = None


@dataclass(frozen=True)
class LikelyModel:
    """One set of effects with its fitted values, SI.

    probability: posterior, 0..1; those of all likely models of a file sum to one. values: what was fitted. covariance: of `names`,
    (K, K), SI. priors: of those of them that had one.
    """

    effects: tuple[str, ...]
    probability: float
    values: Mapping[str, float]
    names: tuple[str, ...] = ()
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    priors: Mapping[str, Prior] = field(default_factory=dict)

    @cached_property
    def deviations(self) -> np.ndarray:
        """Standard deviation of each of `names` by the covariance, (K,), SI; 0 where that has none."""
        return deviations_of(self.covariance)

    @cached_property
    def correlation(self) -> np.ndarray:
        """The covariance over these deviations on either side, (K, K)."""
        return correlation_of(self.covariance)


@dataclass(frozen=True)
class ModelOutput:
    """A sensor that the model was fitted to, SI. noise: sigma of a sample. offset: whether each run has its own zero.

    prediction_error: what nine of ten samples of runs that the fit had not seen stay within; None where none was left out. reading_noise: sigma of
    a single reading, where a sample averages several or its noise was fitted (it then holds what the model lacks), else None.
    """

    name: str
    unit: str
    noise: float
    offset: bool
    prediction_error: float | None = None
    reading_noise: float | None = None


@dataclass(frozen=True)
class FittedRun:
    """A run that the model was fitted to or held against."""

    name: str
    role: str
    sha256: str


@dataclass(frozen=True)
class ModelRecord:
    """What a model file holds.

    parameters: every one of the model, by name. likely: the models that predictions are averaged over, this one first; empty
    where nothing was fitted. fitted_range: quantity -> (lowest, highest) in the fit runs, SI. log_format: how the logs are read.
    """

    title: str
    wire: str
    load: str
    drive: str
    law: str
    effects: tuple[str, ...]
    parameters: Mapping[str, ModelParameter]
    outputs: tuple[ModelOutput, ...] = ()
    likely: tuple[LikelyModel, ...] = ()
    fitted_range: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    runs: tuple[FittedRun, ...] = ()
    log_format: LogFormat | None = None
    made_with: Mapping[str, str] = field(default_factory=dict)
    unfinished: str = ""  # what was still to come when it was written
    warnings: tuple[str, ...] = ()  # of the file that it was read from
    as_fitted: str = ""  # what the text of the file said after the fit (`edits.as_written`), of a model that was read

    @property
    def values(self) -> dict[str, float]:
        """Every parameter by name, SI."""
        return {name: one.value for name, one in self.parameters.items()}

    @cached_property
    def table(self) -> dict[str, Parameter]:
        """Unit, bounds and meaning of every parameter."""
        return parameters(self.system)

    @cached_property
    def system(self) -> System:
        """The model with its values, ready to be simulated.

        Arrays of numbers, also where it is first asked for inside a function that JAX traces (`jit`, `vmap`, `grad`): a tracer that
        is kept would be of no use outside of that function.
        """
        with jax.ensure_compile_time_eval():
            return self.system_of(self.effects, self.values)

    def system_of(self, effects: Sequence[str], values: Mapping[str, float], carried: Sequence[str] = ()) -> System:
        """The same wire, load and drive with `effects`, at this model's values and then at `values`, SI.

        `carried`: further effects, which are there and change nothing.
        """
        model = extended(build(self.wire, self.load, self.drive, self.law), [*effects, *carried])
        known = {
            name: value
            for name, value in {**self.values, **values}.items()
            if "." not in name or name.split(".")[0] in effects
        }
        table = parameters(model)
        return set_parameters(model, {name: value for name, value in known.items() if name in table})

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors of the fitted values that runs determined, SI: also barely, which have none in the text of the file."""
        barely = {
            name: float(error) for one in self.likely[:1] for name, error in zip(one.names, one.deviations, strict=True)
        }
        fitted = {name: one.standard_error for name, one in self.parameters.items() if one.origin == "fitted"}
        found = {**barely, **{name: error for name, error in fitted.items() if error is not None}}
        return {name: error for name, error in found.items() if error > 0.0}

    @property
    def weighted(self) -> tuple[tuple[LikelyModel, ...], np.ndarray]:
        """(the M likely models, their weights (M,), which sum to one); where nothing was fitted the model itself."""
        likely = self.likely or (LikelyModel(self.effects, 1.0, {}),)
        probabilities = np.asarray([one.probability for one in likely])
        return likely, probabilities / probabilities.sum()

    @property
    def every_effect(self) -> tuple[str, ...]:
        """Effects of any of the likely models."""
        return tuple(
            dict.fromkeys(name for effects in (self.effects, *(one.effects for one in self.likely)) for name in effects)
        )

    def draws(self, count: int, seed: int = 0) -> list[System]:
        """`count` models from the posterior, each of `plants` by itself."""
        plants = self.plants(count, seed)
        return [jax.tree.map(lambda leaf, at=at: leaf[at], plants) for at in range(count)]

    def plants(self, count: int, seed: int = 0) -> System:
        """`count` models from the posterior as one system, each of whose values has shape (count,), for `jax.vmap`.

        Each is a likely model by its probability, then its values by their covariance, within bounds. All carry the effects of all
        likely models, at base value where theirs has none. Where nothing was fitted all are the model itself.
        """
        random = np.random.default_rng(seed)
        likely, weights = self.weighted
        chosen = random.choice(len(likely), size=count, p=weights)
        with jax.ensure_compile_time_eval():  # numbers also inside a function that JAX traces
            base = self.system_of((), {}, self.every_effect)
        columns = {name: np.full(count, value) for name, value in parameter_values(base).items()}
        for number, model in enumerate(likely):
            own = chosen == number
            known = {name: value for name, value in self.values.items() if name.split(".")[0] in model.effects}
            for name, value in {**known, **model.values, **self._drawn(model, int(own.sum()), random)}.items():
                columns[name][own] = value
        return set_parameters(base, columns)

    def _drawn(self, model: LikelyModel, count: int, random: np.random.Generator) -> dict[str, np.ndarray]:
        """Values of what the covariance of one likely model covers, (count,) each: a normal distribution cut off at the bounds.

        Draws with a value out of its bounds, or two in the wrong order, are drawn again as a whole. Where hardly any are inside, the
        last are moved to the bounds.
        """
        if not model.names or not count:
            return {}
        mean = np.asarray([model.values[name] for name in model.names])
        eigenvalues, vectors = np.linalg.eigh(model.correlation)
        root = (vectors * np.sqrt(np.maximum(eigenvalues, 0.0))).T
        low, high = np.asarray([self._bounds[name] for name in model.names]).T
        found = np.empty((0, len(mean)))
        values = mean[None]
        for _ in range(ROUNDS):
            values = mean + model.deviations * (random.standard_normal((2 * count, len(mean))) @ root)
            inside = np.all((values >= low) & (values <= high), axis=1) & self._ordered(model, values)
            found = np.concatenate([found, values[inside]])
            if len(found) >= count:
                break
        missing = count - len(found)
        if missing > 0:
            found = np.concatenate([found, np.clip(values[np.arange(missing) % len(values)], low, high)])
        return {name: found[:count, k] for k, name in enumerate(model.names)}

    def _ordered(self, model: LikelyModel, values: np.ndarray) -> np.ndarray:
        """Whether each of the draws (n, K) has its transformation temperatures in their order, (n,)."""
        known = {**self.values, **model.values}
        result = np.ones(len(values), dtype=bool)
        for lower, higher, _ in ORDER:
            if lower in known and higher in known:
                ends = [
                    values[:, model.names.index(name)] if name in model.names else known[name]
                    for name in (lower, higher)
                ]
                result &= np.asarray(ends[0] < ends[1])
        return result

    @cached_property
    def _bounds(self) -> dict[str, tuple[float, float]]:
        """Of the fit, for what was fitted in this model; what makes physical sense, for the other effects of likely ones."""
        whole = parameters(self.system_of(self.every_effect, {}))
        own = {name: (one.low, one.high) for name, one in self.parameters.items()}
        return {name: (one.low, one.high) for name, one in whole.items()} | own
