"""What a tuning was asked for, in words."""

from __future__ import annotations

from dataclasses import dataclass

from smajax.control.tune.settings import TuneSettings
from smajax.report.tune_words import goal_sentence, held_out_sentence, plants_sentence


@dataclass(frozen=True)
class TuningNarrative:
    """The sentences of one tuning."""

    plants: str  # on which gains are tuned; the air as on the arm, 20 degC
    held_out: str  # on what they are checked
    goal: str
    between: str  # what lies between plant and controller


def of_settings(settings: TuneSettings) -> TuningNarrative:
    return TuningNarrative(
        plants=plants_sentence(settings),
        held_out=held_out_sentence(settings),
        goal=goal_sentence(settings),
        between=settings.between_in_words(),
    )
