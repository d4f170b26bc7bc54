"""Measures: numbers that are updated while a run is simulated, so that a sweep of them stores no trajectory."""

from __future__ import annotations

import abc
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp

from smajax.core.names import listed
from smajax.model.types import Inputs, Scalar, Series, State

# What a state shows by name, and its unit; a reading has the load's own.
SHOWN = {
    "temperature": "degC",
    "stress": "Pa",
    "strain": "-",
    "martensite_fraction": "-",
    "position": "",
    "velocity": "",
    "reading": "",
}


def value_of(state: State, name: str) -> Scalar:
    """The named value of a state. KeyError lists the names there are."""
    if name not in SHOWN:
        raise KeyError(f"a state shows {listed(sorted(SHOWN))}, not `{name}`.")
    for part in (state, state.motion, state.wire):
        if hasattr(part, name):
            return getattr(part, name)
    raise AssertionError(name)


class AbstractMeasure(eqx.Module):
    """One number of a run. `update` is called once a step, with the state that the step ended in."""

    smooth: ClassVar[bool] = True  # it moves with the parameters, and not by whole steps

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """What the number is called in a result."""

    @property
    @abc.abstractmethod
    def unit(self) -> str:
        """SI; empty: that of the load's position."""

    def check(self, steps: int) -> None:
        """ValueError where it is no measure of a run of so many steps."""

    @abc.abstractmethod
    def start(self, state: State, inputs: Inputs) -> Any:
        """The memory before the first step."""

    @abc.abstractmethod
    def update(self, memory: Any, state: State, inputs: Inputs, dt: Scalar) -> Any:
        """The memory after a step of `dt` under `inputs` to `state`."""

    @abc.abstractmethod
    def result(self, memory: Any) -> Scalar:
        """The number."""


class Last(AbstractMeasure):
    """The value at the end."""

    of: str = eqx.field(static=True)

    @property
    def name(self) -> str:
        return f"last_{self.of}"

    @property
    def unit(self) -> str:
        return SHOWN[self.of]

    def start(self, state: State, inputs: Inputs) -> Scalar:
        return value_of(state, self.of)

    def update(self, memory: Scalar, state: State, inputs: Inputs, dt: Scalar) -> Scalar:
        return value_of(state, self.of)

    def result(self, memory: Scalar) -> Scalar:
        return memory


class Largest(Last):
    """The largest value."""

    @property
    def name(self) -> str:
        return f"largest_{self.of}"

    def update(self, memory: Scalar, state: State, inputs: Inputs, dt: Scalar) -> Scalar:
        # Not `maximum` with the memory first or last: a NaN must stay one.
        now = value_of(state, self.of)
        return jnp.where(memory > now, memory, now)


class Smallest(Last):
    """The smallest value."""

    @property
    def name(self) -> str:
        return f"smallest_{self.of}"

    def update(self, memory: Scalar, state: State, inputs: Inputs, dt: Scalar) -> Scalar:
        now = value_of(state, self.of)
        return jnp.where(memory < now, memory, now)


class Mean(AbstractMeasure):
    """The mean over time, each step counted with the value that it ended in."""

    of: str = eqx.field(static=True)

    @property
    def name(self) -> str:
        return f"mean_{self.of}"

    @property
    def unit(self) -> str:
        return SHOWN[self.of]

    def start(self, state: State, inputs: Inputs) -> tuple[Scalar, Scalar]:
        zero = jnp.zeros_like(state.time)
        return zero, zero

    def update(self, memory: tuple[Scalar, Scalar], state: State, inputs: Inputs, dt: Scalar) -> tuple[Scalar, Scalar]:
        total, time = memory
        return total + dt * value_of(state, self.of), time + dt

    def result(self, memory: tuple[Scalar, Scalar]) -> Scalar:
        total, time = memory
        return total / time


class MeanSquare(AbstractMeasure):
    """The mean square of the distance from a series, in units of `scale`: a cost of tracking, or of a fit, to differentiate.

    of: what a state shows. wanted: its values, SI, from the start to the end of the last step, (steps + 1,), the same for all runs of a
    batch; or a number. The first is not compared: nothing has happened by then.
    """

    of: str = eqx.field(static=True)
    wanted: Series = eqx.field(converter=jnp.asarray)
    scale: Scalar = eqx.field(converter=jnp.asarray, default=1.0)

    @property
    def name(self) -> str:
        return f"mean_square_{self.of}"

    @property
    def unit(self) -> str:
        return "-"

    def check(self, steps: int) -> None:
        if self.wanted.shape not in ((), (steps + 1,)):
            raise ValueError(
                f"`wanted` of {self.name} has the shape {self.wanted.shape}: a run of {steps} steps takes {steps + 1} values, from its "
                "start to its end, or one number. Runs with a series each are batches of their own."
            )

    def start(self, state: State, inputs: Inputs) -> tuple[Scalar, Scalar]:
        return jnp.zeros_like(state.time, int), jnp.zeros_like(state.time)

    def update(self, memory: tuple[Scalar, Scalar], state: State, inputs: Inputs, dt: Scalar) -> tuple[Scalar, Scalar]:
        number, total = memory
        wanted = self.wanted if self.wanted.ndim == 0 else self.wanted[number + 1]
        return number + 1, total + ((value_of(state, self.of) - wanted) / self.scale) ** 2

    def result(self, memory: tuple[Scalar, Scalar]) -> Scalar:
        number, total = memory
        return total / number


class TimeAbove(AbstractMeasure):
    """When the value first is above a threshold, s; infinite where it never is."""

    smooth: ClassVar[bool] = False

    of: str = eqx.field(static=True)
    threshold: Scalar = eqx.field(converter=jnp.asarray)

    @property
    def name(self) -> str:
        return f"time_above_{self.of}"

    @property
    def unit(self) -> str:
        return "s"

    def start(self, state: State, inputs: Inputs) -> Scalar:
        return jnp.where(value_of(state, self.of) > self.threshold, state.time, jnp.inf)

    def update(self, memory: Scalar, state: State, inputs: Inputs, dt: Scalar) -> Scalar:
        above = value_of(state, self.of) > self.threshold
        return jnp.where(above & (memory > state.time), state.time, memory)

    def result(self, memory: Scalar) -> Scalar:
        return memory
