r"""Normal prior of a coefficient of an effect, from its effect's `Width` and from how far the runs of an experiment go.

Of a coefficient $\theta$ with the base value $\theta_0$ the prior is $\theta \sim N(\theta_0, s^2)$, or $\ln\theta \sim
N(\ln\theta_0, s^2)$ where it is logarithmic, given that the wire or the bench has the effect (automatic relevance
determination: MacKay 1992, Tipping 2001).
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from smajax.core.names import close_matches
from smajax.core.parameters import Parameter, parameters
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Extent, Origin, Scale, Width

# Of what a `Width` does not say.
SWITCH_GUESSES = 2.0  # width of a switch over its initial guess, which is a usual size
LOGARITHMIC = 1.0  # of a positive time, width or scale: a factor of 2.7 either way
SHARE_OF_BOUNDS = 0.25  # of any other: the bounds are two widths from their middle

_PHRASES: dict[Scale, str] = {
    "stroke": "of the stroke",
    "increment": "of the increment",
    "run": "of a run's length",
    "load": "of the load at rest",
    "command": "of the largest command",
    "stroke/run": "of the stroke per run",
}
_ORIGIN_PHRASES: dict[Origin, str] = {"lowest": " above the lowest reading", "highest": " above the highest reading"}


class CoefficientPrior(NamedTuple):
    """Normal distribution of a coefficient, or of its natural logarithm."""

    base: float  # where it is centred, in the coefficient's unit, also where it is logarithmic
    sigma: float  # standard deviation, in the coefficient's unit, or of the natural logarithm
    logarithmic: bool

    def deviation(self, value: float) -> float:
        """Widths of `value` from the base."""
        if self.logarithmic:
            return math.log(max(value, 1e-300) / self.base) / self.sigma
        return (value - self.base) / self.sigma


def width_of(
    effect: type[AbstractEffect],
    coefficient: str,
    bounds: tuple[float, float] | None,
    extent: Extent,
    load_at_rest: float = 0.0,
) -> CoefficientPrior:
    """Prior of one coefficient of `effect`, by its own name (`"enthalpy"`).

    `bounds`: within which it is fitted, in its unit; None for its own and those of the runs (`Candidate.bounds`).
    `load_at_rest`: size of the load's force at its start (`load.force.force_at_rest`), N, or N m on an arm; 0 where
    there is none. The width is at most half of the bounds, of their logarithm where it is logarithmic. A width of which
    the scale is zero (no force at rest, no increment) is that of a coefficient that is not listed in `Candidate.widths`:
    a switch has twice its initial guess, any other a logarithmic width of 1 where its lower bound is positive, and a
    quarter of its bounds where it is not.
    Raises ValueError, with close matches, where the effect has no such coefficient.
    """
    entry = entry_of(effect, coefficient)
    low, high = bounds or effect.candidate.bounds(extent).get(coefficient, (entry.low, entry.high))
    width = stated_width(effect, coefficient)
    scale = _scale(width.of, extent, load_at_rest)
    if not scale > 0.0:
        width, scale = _unlisted(effect, coefficient, (low, high)), 1.0
    origins: dict[Origin, float] = {"": 0.0, "lowest": extent.lowest, "highest": extent.highest}
    base = min(max(origins[width.above] + scale * _base(effect, coefficient, width), low), high)
    if width.logarithmic:
        widest = 0.5 * math.log(high / low) if low > 0.0 else math.inf
        return CoefficientPrior(base, min(width.sigma, widest), True)
    return CoefficientPrior(base, min(width.sigma * scale, 0.5 * (high - low)), False)


def stated_width(effect: type[AbstractEffect], coefficient: str) -> Width:
    """Width and base of a coefficient before any runs are known: what its effect says, and else what an unlisted one has.

    Raises ValueError, with close matches, where the effect has no such coefficient.
    """
    entry = entry_of(effect, coefficient)
    width = effect.candidate.widths.get(coefficient) or _unlisted(effect, coefficient, (entry.low, entry.high))
    return width._replace(base=_base(effect, coefficient, width))


def entry_of(effect: type[AbstractEffect], coefficient: str) -> Parameter:
    """Unit, bounds and meaning of a coefficient; ValueError, with close matches, where the effect has none of that name."""
    entries = _at_base(effect)[0]
    if coefficient not in entries:
        near = close_matches(coefficient, sorted(entries), "it has")
        raise ValueError(f"The effect `{effect.effect_name}` has no coefficient `{coefficient}`{near}.")
    return entries[coefficient]


def unit_of_width(unit: str, width: Width) -> str:
    """What the base of a width is in, and its sigma where it is not logarithmic, of a coefficient in `unit`.

    As "J/kg", "of the stroke" or "K per run"; a base also with what it counts from.
    """
    if width.of == "1/run":
        return f"{unit.removesuffix('/s')} per run"
    return _PHRASES.get(width.of, unit) + _ORIGIN_PHRASES.get(width.above, "")


def _scale(of: Scale, extent: Extent, load_at_rest: float) -> float:
    """What a width is times, SI; 0 where these runs or this load have none."""
    lasts = extent.seconds > 0.0
    scales: dict[Scale, float] = {
        "": 1.0,
        "stroke": extent.stroke,
        "increment": extent.increment,
        "run": extent.seconds,
        "load": abs(load_at_rest),
        "command": extent.command,
        "1/run": 1.0 / extent.seconds if lasts else 0.0,
        "stroke/run": extent.stroke / extent.seconds if lasts else 0.0,
    }
    return scales[of]


Values = tuple[dict[str, Parameter], dict[str, float]]  # by name


def _at_base(effect: type[AbstractEffect]) -> Values:
    """(entries, values) of an effect's coefficients at its base."""
    return _at_base_in(effect, jnp.zeros(()).dtype)  # type: ignore[arg-type]  # mypy asks for the hash of an instance


@cache
def _at_base_in(effect: type[AbstractEffect], _: np.dtype[Any]) -> Values:
    """The same; the kind of numbers is that of the values."""
    base, prefix = effect.base(), f"{effect.effect_name}."
    entries = {name.removeprefix(prefix): one for name, one in parameters(base).items()}
    return entries, {name: float(getattr(base, name)) for name in entries}


def _default(effect: type[AbstractEffect], coefficient: str) -> float:
    return _at_base(effect)[1][coefficient]


def _base(effect: type[AbstractEffect], coefficient: str, width: Width) -> float:
    """Where a prior is centred, over the scale of its width."""
    if width.base is not None:
        return width.base
    default = _default(effect, coefficient)
    if coefficient in effect.candidate.switches:
        return default
    return float(effect.candidate.initial_guess.get(coefficient, default))


def _unlisted(effect: type[AbstractEffect], coefficient: str, bounds: tuple[float, float]) -> Width:
    """Width of a coefficient of which its effect gives none, or none that these runs have a scale for."""
    low, high = bounds
    candidate, default = effect.candidate, _default(effect, coefficient)
    switch = coefficient in candidate.switches
    guess = abs(float(candidate.initial_guess.get(coefficient, default)) - default)
    if switch and guess > 0.0:
        return Width(SWITCH_GUESSES * guess, "twice the initial guess of a refit")
    if not switch and low > 0.0:
        return Width(LOGARITHMIC, "a factor of 2.7 either way", logarithmic=True)
    return Width(SHARE_OF_BOUNDS * (high - low), "a quarter of the bounds")
