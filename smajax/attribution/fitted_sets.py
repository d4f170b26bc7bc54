"""The sets of effects that a joint search has fitted, with their evidence, its settings, and its rounds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel, independent_error
from smajax.attribution.record_error import FoundRecordErrors
from smajax.attribution.unknown.search import AskedFor
from smajax.core.progress import quiet
from smajax.fit.levenberg_marquardt import FitSettings
from smajax.model.effects.candidate import Extent


def nothing(_: Any) -> None:
    """Of a search that nobody follows."""


def no(_: Any) -> bool:
    """Of a search that nobody ends."""
    return False


@dataclass
class JointSearch:
    """Settings of the search, and every model fitted in it."""

    joint: JointParameters
    extent: Extent
    settings: FitSettings
    noise: float  # of a sample, SI
    noise_given: bool = True  # by the experiment file; else estimated from neighbouring samples
    fitted: dict[tuple[str, ...], FittedModel] = field(default_factory=dict)
    trials: dict[tuple[str, ...], float] = field(
        default_factory=dict
    )  # error of a sample at which a set was fitted last
    rounds: list[JointRound] = field(default_factory=list)
    excluded: frozenset[str] = frozenset()  # candidates that no set may have
    detectable: tuple[str, ...] = ()
    programs: tuple[tuple[str, ...], ...] = ()  # effects that each program of the fits so far carries
    traced: tuple[tuple[str, ...], ...] = ()  # and each of the linear models so far
    winner: tuple[str, ...] = ()  # effects of the likeliest model when the search had ended
    rounds_before: int = 0  # of an earlier search, from whose models this one begins
    asked_for_one: bool = False  # whether one effect was sought in the place of the many of a model
    thorough: bool = True  # ends only where no effect of the likeliest model can be removed or replaced
    on_round: Callable[[JointRound], None] = nothing
    # Gets the model of each round: what the end will ask may be begun.
    begin_ahead: Callable[[FittedModel], None] = nothing
    # What the search goes on from in the place of a model of many effects, itself where nothing is to be sought beside it; None: as it is.
    in_place_of_many: Callable[[FittedModel], FittedModel | None] = nothing
    # What it goes on from where it would end with a model; None: it ends.
    before_the_end: Callable[[FittedModel], FittedModel | None] = nothing
    # Whether the record of one run is wrong where a model of many effects leaves many noises: the search ends, and is made again with it corrected.
    has_wrong_record: Callable[[FittedModel], bool] = no
    # Whether it ends with a model because values of presets, which it holds, can make up for most of what that leaves.
    needs_presets: Callable[[FittedModel], bool] = no
    wrong_record: FoundRecordErrors | None = None
    free_beside: tuple[str, ...] | None = (
        None  # effects beside which free values of presets take most of what is left, if that ended the search
    )
    lacking: AskedFor | None = None  # unknown terms beside the base model, where they were asked for

    def alone(self) -> JointSearch:
        """What was fitted, for a second process, which does not search."""
        settings = replace(self.settings, progress=quiet, cache=self.settings.cache.alone())
        return JointSearch(
            self.joint,
            self.extent,
            settings,
            self.noise,
            self.noise_given,
            dict(self.fitted),
            detectable=self.detectable,
            programs=self.programs,
            traced=self.traced,
            winner=self.winner,
        )

    def error(self, model: FittedModel) -> float:
        """`independent_error` of what `model` leaves."""
        return independent_error(model, self.noise, self.noise_given)

    def error_of(self, effects: Sequence[str]) -> float:
        """`error` of the fitted model with these effects."""
        return self.error(self.fitted[self.joint.ordered(effects)])

    def best(self, error: float) -> FittedModel:
        """The likeliest model."""
        return max(self.fitted.values(), key=lambda model: model.log_evidence(error**2))

    def probabilities(self, error: float) -> dict[tuple[str, ...], float]:
        """Of every fitted set, among these."""
        values = np.asarray([model.log_evidence(error**2) for model in self.fitted.values()])
        weights = np.exp(values - values.max())
        return dict(zip(self.fitted, (weights / weights.sum()).tolist(), strict=True))

    def effect_probabilities(self, error: float) -> dict[str, float]:
        """Of each effect that one of them has."""
        found: dict[str, float] = {}
        for effects, probability in self.probabilities(error).items():
            for effect in effects:
                found[effect] = found.get(effect, 0.0) + probability
        return found


@dataclass(frozen=True)
class JointRound:
    """One round: what was fitted, and what is likeliest since."""

    error: float  # of an independent sample, SI
    present: tuple[str, ...]
    gains: tuple[tuple[tuple[str, ...], float, float], ...]  # (effects, log evidence over the present model's, rms SI)
    best: tuple[str, ...]
    best_gain: float  # log evidence of the best over the present model's
