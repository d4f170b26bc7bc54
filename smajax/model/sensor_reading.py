"""What the sensor shows: a true value, late, through what the effects make of it."""

from __future__ import annotations

import abc
from typing import ClassVar, NamedTuple, Self

from smajax.model.types import Scalar, Series, State

FOLLOWED = "followed"  # entry of `State.sensor`: the late value, where the sensor shows another one


class SensorLagTerm(abc.ABC):
    """A sensor that follows the true value."""

    @abc.abstractmethod
    def sensor_time_constant(self) -> Scalar | float:
        """Time constant of a first-order sensor, s."""


class SensorTerm(abc.ABC):
    """A sensor that shows another value."""

    effect_name: ClassVar[str]  # its entry of `State.sensor`
    recalls: ClassVar[bool] = False  # whether `sensed` needs its own last reading

    @abc.abstractmethod
    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        """What the sensor shows where it would show `reading`, the lag included; `last`: what this gave before."""


class LevelTerm(SensorTerm):
    """A sensor that shows levels: of a measured reading it is known between which two edges the motion was, and nowhere in between."""

    @abc.abstractmethod
    def near(self, reading: Series, measured: Series, level: Scalar) -> Series:
        """What a fit holds against the samples `measured` of a run, (n,), where the sensor would show `reading` without its levels: the level that was measured, and how far the motion lies outside of it.

        `level`: what was measured at one of the levels; a `measured` of NaN, a missing sample: what the sensor shows.
        """

    @abc.abstractmethod
    def with_mean_slope(self, noise: Scalar | float) -> Self:
        """The same, with derivatives by what a reading tells in the mean, and not by what pulls at a fit; `noise` of a reading, in its unit."""


class SensorTerms(NamedTuple):
    """All that effects change in the reading of the sensor."""

    lags: tuple[SensorLagTerm, ...] = ()
    readings: tuple[SensorTerm, ...] = ()


def time_constant(terms: SensorTerms) -> Scalar | float | None:
    """Of the sensor, s; None where no effect gives it one."""
    return sum(term.sensor_time_constant() for term in terms.lags) if terms.lags else None


def followed(state: State) -> Scalar:
    """The late value at `state`."""
    return state.sensor.get(FOLLOWED, state.reading)


def first_reading(terms: SensorTerms, value: Scalar, time: Scalar) -> tuple[Scalar, dict[str, Scalar]]:
    """(reading, history of the sensor) at rest at `value`."""
    names = [term.effect_name for term in terms.readings if term.recalls]
    late = [FOLLOWED] if terms.lags and terms.readings else []
    return reading_of(terms, value, time, dict.fromkeys([*late, *names], value), at_start=True)


def reading_of(
    terms: SensorTerms, late: Scalar, time: Scalar, before: dict[str, Scalar], at_start: bool = False
) -> tuple[Scalar, dict[str, Scalar]]:
    """(reading, history of the sensor) at `time` (s) where the late value is `late`; `before`: the history so far."""
    reading = late
    history = {FOLLOWED: late} if FOLLOWED in before else {}
    for term in terms.readings:
        # At rest: its last reading is this one.
        last = reading if at_start else before.get(term.effect_name, reading)
        reading = term.sensed(reading, time, last)
        if term.recalls:
            history[term.effect_name] = reading
    return reading, history
