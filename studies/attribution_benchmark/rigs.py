"""The four rigs, and what each shows of a run: noise-free readings with the effects of the truth."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.actuator import Actuator
from studies.attribution_benchmark.coupon import LEVEL, strain
from studies.attribution_benchmark.march import march
from studies.attribution_benchmark.parameters import GRAVITY, Effects, Load, Wire
from studies.attribution_benchmark.runs import Clock, Run, heated, powered
from studies.attribution_benchmark.sensor import reading

Vector = NDArray[np.float64]
RTOL = 1e-8


@dataclass(frozen=True)
class Rig:
    """A rig with its nominal wire, its excitations and its sensor."""

    name: str
    wire: Wire
    load: Callable[[float], Load] | None  # of the mass hung on it, kg; None: a coupon
    clock: Clock
    runs: Callable[[Wire], tuple[Run, ...]]  # of the wire at hand
    noise: float  # standard deviation of a reading: rad, m, or strain
    unknowns: tuple[str, ...]
    mass: float = 0.0  # kg, where no run gives it

    @property
    def stroke(self) -> float:
        """Reading of a full transformation."""
        w = self.wire
        return w.recoverable_strain * (1.0 if self.load is None else w.wire_length / self.load(self.mass or 1.0).ratio)


def _arm(_mass: float) -> Load:
    length, payload, link, lever = 0.04738, 0.05719, 0.0187, 0.048
    low = math.radians(-45.0)
    return Load(
        ratio=2 * 0.00825,
        inertia=(payload + link / 3) * length**2,
        damping=3e-3,
        weight=(payload + link / 2) * GRAVITY * length,
        turns=True,
        stiffness=3.871 * lever**2,
        start=low,
        low=low,
        high=math.radians(95.0),
    )


def _dead_weight(mass: float) -> Load:
    return Load(ratio=1.0, inertia=mass, damping=100.0, weight=mass * GRAVITY)


def _bias_spring(_mass: float) -> Load:
    return Load(ratio=1.0, inertia=0.035, damping=20.0, force=8.0, stiffness=60.0)


HEATED = (
    "convection_coefficient",
    "specific_heat",
    "recoverable_strain",
    "austenite_start",
    "austenite_finish",
    "martensite_start",
    "martensite_finish",
)
ARM_CLOCK, HUNG_CLOCK, SPRING_CLOCK = Clock(0.025, 20, 801), Clock(0.05, 10, 601), Clock(0.25, 8, 601)
COUPON_CLOCK = Clock(1.0, 1, 401)
ARM = Rig(
    "arm",
    Wire(
        wire_length=0.9,
        wire_diameter=150e-6,
        density=1.14e-4 / (math.pi * 150e-6**2 / 4),
        specific_heat=837.0,
        convection_coefficient=150.0,
        ambient_temperature=20.0,
        resistivity_austenite=45 * math.pi * 150e-6**2 / 4,
        resistivity_martensite=45 * math.pi * 150e-6**2 / 4,
        recoverable_strain=0.043,
        gain=1.8,
    ),
    _arm,
    ARM_CLOCK,
    lambda wire: powered(ARM_CLOCK, wire, 105e6, 105e6),
    math.radians(0.4),
    HEATED,
)
DEAD_WEIGHT = Rig(
    "dead_weight",
    Wire(
        wire_length=0.537,
        wire_diameter=0.31e-3,  # thicker than the source's, so that a 10 Hz log can follow it
        specific_heat=322.0,
        convection_coefficient=150.0,
        ambient_temperature=23.0,
        resistivity_austenite=84e-8,
        resistivity_martensite=76e-8,
        stress_slope_austenite=6.89e6,
        stress_slope_martensite=6.89e6,
        recoverable_strain=0.02475 / 0.537,
    ),
    _dead_weight,
    HUNG_CLOCK,
    lambda wire: powered(HUNG_CLOCK, wire, 83e6, 139e6, (0.64, 1.07)),
    0.08e-3,
    HEATED,
    mass=0.64,
)
BIAS_SPRING = Rig(
    "bias_spring",
    Wire(
        wire_length=0.96,
        wire_diameter=0.5e-3,
        specific_heat=837.0,
        convection_coefficient=80.0,
        ambient_temperature=22.0,
        resistivity_austenite=4.3 * math.pi * 0.5e-3**2 / 4,
        resistivity_martensite=4.3 * math.pi * 0.5e-3**2 / 4,
        austenite_start=88.0,
        austenite_finish=98.0,
        martensite_start=72.0,
        martensite_finish=62.0,
        recoverable_strain=0.02,
        drive="duty",
        gain=25.0,
    ),
    _bias_spring,
    SPRING_CLOCK,
    lambda wire: powered(SPRING_CLOCK, wire, 44e6, 44e6),
    0.06e-3,
    HEATED,
)
COUPON = Rig(
    "coupon",
    Wire(
        wire_length=0.1,
        wire_diameter=0.5e-3,
        specific_heat=837.0,
        convection_coefficient=80.0,
        ambient_temperature=22.0,
        resistivity_austenite=84e-8,
        resistivity_martensite=76e-8,
        stress_slope_austenite=8e6,
        stress_slope_martensite=7.5e6,
        recoverable_strain=0.04,
    ),
    None,
    COUPON_CLOCK,
    lambda _wire: heated(COUPON_CLOCK, 30.0, 125.0, (50e6, 100e6, 200e6, 150e6)),
    5e-5,
    (*HEATED[2:], "stress_slope_austenite", "stress_slope_martensite"),
)
RIGS = {rig.name: rig for rig in (ARM, DEAD_WEIGHT, BIAS_SPRING, COUPON)}


def simulate(rig: Rig, wire: Wire, run: Run, effects: Effects) -> Vector:
    """States of the actuator (its `names`), and below them the martensite fraction, at the samples of one run."""
    if rig.load is None:
        raise ValueError("a coupon has no states to integrate; expected a rig with a load; use `show`")
    clock, masses = rig.clock, run.other
    delay, wrong = effects.get("input_delay", 0.0), 1 + effects.get("wrong_load", 0.0)
    actuator = actuator_of(rig, wire, run, effects)
    changes = np.flatnonzero(np.diff(run.command)) + 1
    breaks = {0.0, *(changes * clock.step + delay), *actuator.heat.breaks()}
    if masses is not None:
        breaks |= set((np.flatnonzero(np.diff(masses)) + 1) * clock.step)
    starts = sorted(t for t in breaks if t < clock.seconds - 1e-9)
    ends = [*starts[1:], clock.seconds]

    def begin(t: float) -> None:
        # a hair late, so that a sample that falls on the break is the one that begins there
        actuator.command = float(run.command[max(math.floor((t - delay) / clock.step + 1e-6), 0)])
        if masses is not None and rig.load is not None:
            actuator.load = rig.load(wrong * float(masses[math.floor(t / clock.step + 1e-6)]))
            actuator.mechanics.carry(actuator.load)

    return march(actuator, [(end, begin) for end in ends], clock.times, RTOL, min(clock.step, 0.2) / 2)


def actuator_of(rig: Rig, wire: Wire, run: Run, effects: Effects) -> Actuator:
    """The actuator at the start of a run."""
    if rig.load is None:
        raise ValueError("a coupon is no actuator; expected a rig with a load; use `show`")
    wrong = 1 + effects.get("wrong_load", 0.0)
    load = rig.load(wrong * (float(run.other[0]) if run.other is not None else rig.mass))
    if run.other is None:
        load = replace(load, weight=load.weight * wrong, force=load.force * wrong)
    return Actuator(wire, load, effects, rig.clock.seconds, largest_command(rig, wire), level(rig, wire))


def largest_command(rig: Rig, wire: Wire) -> float:
    """Of all runs: a supply, a dead zone and a limit are the same in each of them."""
    return max(float(run.command.max()) for run in rig.runs(wire))


def level(rig: Rig, wire: Wire) -> float:
    """Stress, Pa, at which widths are as given: that of the lightest load at rest, in all runs."""
    if rig.load is None:
        return LEVEL
    masses = [float(run.other.min()) for run in rig.runs(wire) if run.other is not None]
    load = rig.load(min(masses, default=rig.mass))
    return load.resistance(load.start) / (load.ratio * wire.area)


def value(rig: Rig, wire: Wire, run: Run, effects: Effects) -> Vector:
    """What a perfect sensor would read in one run: angle from its start (rad), way (m), or strain from its start."""
    if rig.load is None:
        return strain(wire, rig.clock.times, run, effects)
    position = simulate(rig, wire, run, effects)[2]
    return position - position[0]


def show(rig: Rig, wire: Wire, run: Run, effects: Effects) -> Vector:
    """Noise-free reading of one run."""
    return reading(rig.clock.times, value(rig, wire, run, effects), effects, rig.stroke)
