"""A draft of an experiment file on disk: loaded as every command loads it, and with the values that matter on its runs first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from smajax.attribution.preset_ranking import PresetRanking, rank_presets
from smajax.core.files import replace
from smajax.data.experiment.draft import Draft
from smajax.data.experiment.errors import ExperimentError
from smajax.data.open_experiment import open_experiment
from smajax.report.preset_words import remarks, starts_of


@dataclass(frozen=True)
class DraftFile:
    """A draft as the other commands load it: warnings; why it cannot be loaded, or ""; what its runs depend on, None where that is not known; whether its starts
    are those of the ranking and not the preset's."""

    warnings: Sequence[str]
    reason: str
    ranking: PresetRanking | None
    begun: bool = False


def write_draft(result: Draft, out: Path) -> DraftFile:
    """Write the draft to `out`; then once more, if it can be loaded, with the presets' values in the order of their influence."""
    replace(out, result.text)
    try:
        experiment = open_experiment(out)
    except ExperimentError as error:
        return DraftFile([], str(error), None)
    ranking = rank_presets(experiment)
    if ranking is None:
        return DraftFile(experiment.warnings, "", None)
    starts = starts_of(ranking) if result.presets else {}  # of a file or a model of the user's they are chosen
    replace(out, result.begun_at(starts).in_order(remarks(ranking)).text)
    return DraftFile(experiment.warnings, "", ranking, bool(starts))
