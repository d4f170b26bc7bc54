"""What happens to the loops: series of the set point and of the inputs that disturb, on one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from smajax.control.reference import clock
from smajax.core.parameters import get_parameters
from smajax.model.load.base import GRAVITY
from smajax.model.rigs import arm

STEP, SECONDS = 0.005, 48.0  # s
HELD = 20.0  # degrees
STAIRCASE = (0.0, 30.0, 60.0, 80.0, 60.0, 30.0, 0.0, -30.0)  # degrees, from rest at -45
EVENTS = (12.0, 24.0, 36.0)  # s: on, off, the same the other way
SHARE = 0.2  # of the payload, and of the gravity torque of the horizontal arm
COLDER = 20.0  # K, what a draught of 1.3 times the convection takes from a wire at 87 C in air of 20 C
CHANNELS = ("load_torque", "added_mass", "ambient_temperature")


@dataclass(frozen=True)
class Scenario:
    """A loop's set point (degrees) and disturbances over time, (n,), and the times (s) from which on something is other than before."""

    title: str
    unit: str  # of what disturbs; "" of set points
    wanted: np.ndarray
    disturbance: Mapping[str, np.ndarray]
    events: tuple[float, ...]
    level: float  # of the first event, in `unit`

    def windows(self) -> list[tuple[int, int]]:
        """First sample and the one after the last of what follows each event."""
        ends = [*self.events[1:], SECONDS + STEP]
        return [(round(one / STEP), round(end / STEP)) for one, end in zip(self.events, ends, strict=True)]


def scenarios() -> dict[str, Scenario]:
    """By name."""
    time = np.asarray(clock(SECONDS, STEP))
    payload, link, length, air = map(
        float, get_parameters(arm(), ["payload_mass", "link_mass", "arm_length", "ambient_temperature"])
    )
    torque = SHARE * (payload + 0.5 * link) * GRAVITY * length
    steady = {"load_torque": 0.0, "added_mass": 0.0, "ambient_temperature": air}
    share = np.select([time < EVENTS[0], time < EVENTS[1], time < EVENTS[2]], [0.0, 1.0, 0.0], -1.0)

    def held(title: str, channel: str, size: float, unit: str) -> Scenario:
        series = {name: np.full(time.shape, value) for name, value in steady.items()}
        series[channel] = series[channel] + size * share
        return Scenario(title, unit, np.full(time.shape, HELD), series, EVENTS, size)

    each = SECONDS / len(STAIRCASE)
    number = np.minimum((time / each + 1e-9).astype(int), len(STAIRCASE) - 1)
    undisturbed = {name: np.full(time.shape, value) for name, value in steady.items()}
    starts = tuple(each * k for k in range(len(STAIRCASE)))
    return {
        "set_points": Scenario("set points up and down", "", np.asarray(STAIRCASE)[number], undisturbed, starts, 0.0),
        "load_torque": held("a load torque on the arm", "load_torque", torque, "N m"),
        "draught": held("colder air, as a draught", "ambient_temperature", -COLDER, "K"),
        "payload": held("a payload put down and taken up", "added_mass", SHARE * payload, "kg"),
    }
