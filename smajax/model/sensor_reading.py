"""What the sensor shows: a true value, late, through what the effects make of it."""

from __future__ import annotations

from collections.abc import Sequence

from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar, State

FOLLOWED = "followed"  # entry of `State.sensor`: the late value, where the sensor shows another one


def time_constant(effects: Sequence[AbstractEffect]) -> Scalar | float | None:
    """Of the sensor, s; None where no effect gives it one."""
    lag = sum(effect.sensor_time_constant() for effect in effects)
    return None if isinstance(lag, (int, float)) and lag == 0 else lag


def followed(state: State) -> Scalar:
    """The late value at `state`."""
    return state.sensor.get(FOLLOWED, state.reading)


def first_reading(effects: Sequence[AbstractEffect], shown: Scalar, time: Scalar) -> tuple[Scalar, dict[str, Scalar]]:
    """(reading, what the sensor remembers) at rest at `shown`."""
    names = [effect.effect_name for effect in effects if effect.recalls]
    late = [FOLLOWED] if time_constant(effects) is not None and any(effect.senses() for effect in effects) else []
    return reading_of(effects, shown, time, dict.fromkeys([*late, *names], shown), at_start=True)


def reading_of(
    effects: Sequence[AbstractEffect],
    late: Scalar,
    time: Scalar,
    before: dict[str, Scalar],
    at_start: bool = False,
) -> tuple[Scalar, dict[str, Scalar]]:
    """(reading, what the sensor remembers) where the late value is `late` (s), from what it remembered `before`."""
    reading = late
    now = {FOLLOWED: late} if FOLLOWED in before else {}
    for effect in effects:
        name = effect.effect_name
        # At rest it has shown for ever what it is given.
        last = reading if at_start else before.get(name, reading)
        reading = effect.sensed(reading, time, last)
        if effect.recalls:
            now[name] = reading
    return reading, now
