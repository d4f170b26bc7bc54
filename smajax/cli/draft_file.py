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
from smajax.report.preset_words import remarks


@dataclass(frozen=True)
class DraftFile:
    """A draft as the other commands load it: warnings; why it cannot be loaded, or ""; what its runs depend on, None where that is not known."""

    warnings: Sequence[str]
    reason: str
    ranking: PresetRanking | None


def write_draft(result: Draft, out: Path) -> DraftFile:
    """Write the draft to `out`; then once more, if it can be loaded, with the presets' values in the order of their influence."""
    replace(out, result.text)
    try:
        experiment = open_experiment(out)
    except ExperimentError as error:
        return DraftFile([], str(error), None)
    ranking = rank_presets(experiment)
    if ranking is not None:
        replace(out, result.in_order(remarks(ranking)).text)
    return DraftFile(experiment.warnings, "", ranking)
