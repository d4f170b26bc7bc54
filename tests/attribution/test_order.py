"""Two effects at once: which of them comes first, and in which order runs and library stand, changes nothing."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import pytest

import smajax.data.model_catalogue
from smajax.attribution.close_loop import close_loop
from smajax.attribution.findings import Findings
from smajax.core.parameters import parameters
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment, Unknown
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.base_model import base_model
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.write import write

PAIR = ("asymmetric_transformation", "minor_loops")
NAME = "coupon-asymmetric_transformation+minor_loops-10-101"


@pytest.fixture
def experiment(tmp_path: Path) -> Experiment:
    write(next(case for case in cases(1) if case.name == NAME), tmp_path)
    return load_experiment(tmp_path / NAME / "experiment.toml", CATALOGUE)


def _coefficients(findings: Findings) -> dict[str, float]:
    return {p.name: p.value for p in findings.after if p.name.split(".")[0] in PAIR}


def _knowing(experiment: Experiment, effect: str) -> Experiment:
    """The same where the base model has one of the effects, of unknown size: the loop is left to find the other."""
    full = parameters(extended(base_model(experiment), (effect,), {}))
    entries = [(full[f"{effect}.{name}"], start) for name, start in LIBRARY[effect].candidate.initial_guess.items()]
    own = [Unknown(entry.name, entry.unit, entry.low, entry.high, start) for entry, start in entries]
    return dataclasses.replace(experiment, unknowns=(*experiment.unknowns, *own))


@pytest.mark.slow  # four loops
def test_the_order_of_runs_library_and_discovery_changes_nothing(
    experiment: Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = close_loop(experiment)
    assert found.verdict == "explained"
    assert {effect.name for effect in found.effects if effect.added} == set(PAIR)
    told = _coefficients(found)

    def same(other: Findings, added: Sequence[str]) -> None:
        assert other.verdict == "explained"
        assert {effect.name for effect in other.effects if effect.added} == set(added)
        assert _coefficients(other) == pytest.approx(told, rel=1e-2)

    same(close_loop(dataclasses.replace(experiment, runs=experiment.runs[::-1])), PAIR)
    for first, second in (PAIR, PAIR[::-1]):
        same(close_loop(_knowing(experiment, first)), (second,))
    monkeypatch.setattr(smajax.data.model_catalogue, "LIBRARY", dict(reversed(LIBRARY.items())))
    same(close_loop(experiment), PAIR)
