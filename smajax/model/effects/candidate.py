"""What the search for missing effects (`smajax.attribution`) knows of an effect; no equation reads it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal, NamedTuple, Protocol, get_args

from smajax.model.drive.base import AbstractDrive
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.wire.wire import Wire

Equation = Literal["heat", "electrical", "kinetics", "constitutive", "mechanics", "sensor", "input"]
EQUATIONS: tuple[str, ...] = get_args(Equation)

# material: physics that every wire has. bench: a property that some wires or benches have and others have not (friction,
# lag, gain, leads, supply, training). event: what happens in some runs, or a wrong record. A delay of every record is of the bench: loggers that
# buffer are common. A wrong level or a wrong clock of every record is not, and a delay of one record alone is an event too (`record_fits`).
PriorClass = Literal["material", "bench", "event"]
PRIOR_CLASSES: tuple[str, ...] = get_args(PriorClass)
# Prior odds that the runs of an experiment need one given effect. There are some fifty candidates: with the same odds for
# all of them, two or three per experiment would be odds of 0.05. A property of every wire gets twice that, one that a bench
# may lack about half. An event explains nothing but the run it happens in and can imitate anything there, so it needs
# evidence thirty times as strong (3.5 in its natural logarithm) as a property of every wire.
PRIOR_ODDS: Mapping[PriorClass, float] = MappingProxyType({"material": 0.1, "bench": 0.03, "event": 0.003})

# `Candidate.exclusive_group` of the effects that change how the transformation runs through its range.
TRANSFORMATION_SHAPE = "shape of the transformation"
DELAY = "delay"
CONVECTION_OF_TEMPERATURE = "convection that depends on the temperature"
LOST_MOTION = "lost motion where it turns"

Scale = Literal["", "stroke", "increment", "run", "load", "command", "1/run", "stroke/run"]
SCALES: tuple[str, ...] = get_args(Scale)
Origin = Literal["", "lowest", "highest"]
ORIGINS: tuple[str, ...] = get_args(Origin)


class Extent(NamedTuple):
    """How far the runs of an experiment go."""

    seconds: float  # length of one
    stroke: float  # between the smallest and the largest reading of all, SI
    increment: float  # from one level to the next where the readings lie on levels, SI; 0 where they do not
    lowest: float = 0.0  # reading of all, SI
    highest: float = 0.0  # reading of all, SI; as `lowest`: not known
    one_force: bool = False  # whether the load pulls with the same force in all runs, wherever it is
    command: float = 0.0  # largest of the drive's channel in all runs, SI; 0 without a drive
    noise: float = 0.0  # of a reading, SI
    command_sizes: int = 0  # how many sizes of it there are beside zero, to a hundredth of the largest


def several_forces(extent: Extent) -> bool:
    """Whether runs can show what depends on the stress: under one force it is a constant, which temperatures or strains take up."""
    return not extent.one_force


def time_constants(*shares: float) -> Callable[[Extent], tuple[dict[str, float], ...]]:
    """A grid of `time_constant`, in shares of a run's length."""

    def grid(extent: Extent) -> tuple[dict[str, float], ...]:
        return tuple({"time_constant": share * extent.seconds} for share in shares)

    return grid


class Width(NamedTuple):
    """How far a coefficient lies from its base value, over the wires and benches that have the effect.

    `of` says what `sigma` and `base` are multiplied by: "stroke" is the range of all readings (m, rad on an arm, - for a
    strain), "increment" that of the readings, "run" the length of a run (s), "load" the load's force at rest at its start
    (N, N m on an arm), "command" the largest one of all runs (V, A, W or a duty), "1/run" one over the length of a run and "stroke/run" the stroke over it, for rates; "" is nothing.
    `above`: what `base` counts from, zero or the lowest or the highest of all readings.
    """

    sigma: (
        float  # standard deviation, in the coefficient's unit over that of `of`; -, of its logarithm, where logarithmic
    )
    source: str  # where the number comes from: what is named has it printed; without a name it is an estimate of usual sizes
    of: Scale = ""
    logarithmic: bool = False
    # Middle of the prior, times `of`; None for the base value of a switch and the initial guess of any other coefficient.
    base: float | None = None
    above: Origin = ""


class Actuator(Protocol):
    """A wire, its load and its drive, as a `System` has them."""

    @property
    def wire(self) -> Wire: ...
    @property
    def load(self) -> AbstractMovingLoad | AbstractCoupon: ...
    @property
    def drive(self) -> AbstractDrive: ...


def has_command(system: Actuator) -> bool:
    """Whether a command heats the wire: in an oven there is none."""
    return bool(system.drive.inputs_required)


def _always(_: object) -> bool:
    return True


def _no_grid(_: Extent) -> tuple[dict[str, float], ...]:
    return ()


def _no_bounds(_: Extent) -> dict[str, tuple[float, float]]:
    return {}


def _no_ranges(_: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    return {}


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """How an effect is described, looked for and fitted."""

    title: str  # "latent heat of transformation"
    equation: Equation  # where its physics belongs, whatever contract it is written with
    formula: str  # plain text, with its source
    sentence: str  # for an engineer: what its presence means
    negative_sentence: str = ""  # what it means where all its switches end below zero; "": the same
    # Coefficients that switch the effect on: their base value is zero and the score test looks at them. The others
    # (a width, a scale) mean nothing until a switch is off zero and keep their default until then.
    switches: tuple[str, ...]
    # Where a refit begins, per coefficient: off the base value, because a coefficient that starts on its bound at
    # zero stays there.
    initial_guess: Mapping[str, float]
    # Whether it is a matter of seconds: it means nothing where the samples of a log have no times.
    needs_time: bool = False
    # Whether the load may stick and jump with it: then what a fit gains by it may be the integration's
    # (`attribution.step_size_check`).
    stick_slip: bool = False
    # What it describes, where several effects describe the same in ways that exclude each other: no model of the search has two of one group.
    exclusive_group: str = ""
    # What it looks like in a log, where several effects that do not exclude each other look much the same: in the place of one that was added each of the others is tried.
    similar_group: str = ""
    # Parameters of the base model that say all that its coefficients say where a fit has every one of them free: then it is nothing of its own.
    same_as: tuple[str, ...] = ()
    # Whether its priors take part in the fit whose values are reported as well: they say how smooth a shape is, which the runs alone
    # do not determine.
    keeps_priors: bool = False
    # Whether it can change anything of this wire, load and drive: a candidate that cannot is not looked at.
    applies: Callable[[Actuator], bool] = _always
    # Whether runs of that extent could show it: a candidate that they cannot is not looked at.
    observable: Callable[[Extent], bool] = _always
    # Values of the coefficients that are no switches at which the score test looks too, beside `initial_guess`.
    grid: Callable[[Extent], tuple[dict[str, float], ...]] = _no_grid
    # Bounds of coefficients in the unit of the reading, by the runs: what is wide in metres is narrow in radians.
    bounds: Callable[[Extent], dict[str, tuple[float, float]]] = _no_bounds
    # Ranges of coefficients, positive, from all over which a refit begins where the misfit has many local minima; of
    # the switches as the score test has them.
    start_ranges: Callable[[Mapping[str, float]], dict[str, tuple[float, float]]] = _no_ranges
    # Values of switches at which a refit may begin as well, where the misfit has other minima for other shapes.
    further_starts: tuple[Mapping[str, float], ...] = ()
    # What is known before the runs: the odds that they need it (`PRIOR_ODDS`), and how large its coefficients are where
    # it is present. `prior_width.width_of` has the width of those that are not listed.
    prior_class: PriorClass = "bench"
    widths: Mapping[str, Width] = field(default_factory=dict)
