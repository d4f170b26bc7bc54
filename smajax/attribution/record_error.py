"""What `close-loop` finds of single runs: an input that was recorded wrongly, and a run that does not agree with the others."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple


@dataclass(frozen=True)
class RecordError:
    """An input of one run that was recorded wrongly, and by how much; `close-loop` went on with the run so corrected."""

    run: str
    channel: str  # of the run's inputs, or "load" where no input gives it
    coefficient: str  # "input_delay.delay"
    value: float  # SI, with that run alone
    standard_error: float
    log_odds: float  # over the model that it takes the place of, or stands beside
    instead_of: tuple[str, ...]  # effects that the search had named in its place
    seconds: float  # length of the run
    on_trial: bool = False  # more than noise is left with it; it stands if the search beside it comes down to noise


class FoundRecordErrors(NamedTuple):
    """Errors of one record, or of two, and the effects of the model that they were found beside; none where the values of presets alone are wrong beside these."""

    errors: tuple[RecordError, ...]
    beside: tuple[str, ...]


@dataclass(frozen=True)
class CorrectedRecords:
    """Records of single runs that are corrected in an experiment. `trials`: whether some may be on trial; `asks`: whether others are looked for."""

    errors: tuple[RecordError, ...] = ()
    trials: bool = True
    asks: bool = True

    @property
    def may_try(self) -> bool:
        """Whether the next may be on trial: only the first ones, and not where some did not stand it."""
        return self.trials and not self.errors

    @property
    def on_trial(self) -> bool:
        """Whether one of them is."""
        return any(one.on_trial for one in self.errors)

    def confirmed(self) -> CorrectedRecords:
        """The same, none of them on trial any more."""
        return replace(self, errors=tuple(replace(one, on_trial=False) for one in self.errors))


NO_RECORDS = CorrectedRecords()


@dataclass(frozen=True)
class NotConfirmed:
    """Records that were corrected and do not stand: no model found beside them needs them and, where they were on trial, comes down to noise. They are taken as they were logged."""

    errors: tuple[RecordError, ...]


@dataclass(frozen=True)
class OutlierRun:
    """A fit run that does not agree with the others, by the model fitted to these alone; errors in SI."""

    run: str
    effects: tuple[str, ...]  # of that model; none: the base model
    residual_is_noise: bool  # whether what it leaves of the others is noise
    others_with: float  # error on the others, fitted to all runs
    others_without: float  # and to the others alone
    predicted_rmse: float  # error on this run, by the fit to the others
