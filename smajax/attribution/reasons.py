"""Why a round of the search ended so, or a later stage took effects out of its model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class StepDependent:
    """Effects that lose their gain when the step is halved."""

    effects: str  # joined by " + "
    gain_kept: float  # share


@dataclass(frozen=True)
class LikelierModel:
    """A set of effects is likelier than the present one, by log evidence and prior odds."""

    before: str  # effects joined by " + "
    log_odds: float  # over the model before
    compared: tuple[tuple[str, float, float], ...]  # (effects, log odds over the model before, rms SI on the fit runs)


@dataclass(frozen=True)
class NoLikelierModel:
    """None of the sets of effects that were fitted is likelier than the present one."""

    compared: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True)
class PredictsTooLittle:
    """With the effects the model explains too little of the motion in left-out runs for them to mean anything."""

    explained_variance: float
    least: float


@dataclass(frozen=True)
class NoiseWithoutEffects:
    """Without an effect the model leaves noise as well, and with it, and those removed before it, it is hardly likelier."""

    log_odds: float


@dataclass(frozen=True)
class NoiseWithoutRun:
    """Without one run the base model leaves noise."""

    run: str


@dataclass(frozen=True)
class UnknownTermLikelier:
    """One unknown function in one equation is likelier than all the effects."""

    title: str
    log_odds: float


@dataclass(frozen=True)
class HeldOutWorse:
    """The held-out runs do not validate the effects."""

    rmse_without: float  # SI
    rmse_with: float


Reason: TypeAlias = (
    StepDependent
    | LikelierModel
    | NoLikelierModel
    | PredictsTooLittle
    | NoiseWithoutEffects
    | NoiseWithoutRun
    | UnknownTermLikelier
    | HeldOutWorse
)
