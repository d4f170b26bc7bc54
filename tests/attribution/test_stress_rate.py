"""The source's own discovery, made again: Liang's conditions lack the stress rate, the enhanced ones lack nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from smajax.attribution.close_loop import close_loop
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from studies.stress_rate.run import WIRE, told, write


def _closed(folder: Path, law: str, only: str = "") -> dict[str, Any]:
    path = write(folder, law)
    if only:
        path.write_text(f"{path.read_text()}\n[effects]\nonly = [{only}]\n", encoding="utf-8")
    return told(close_loop(load_experiment(path, CATALOGUE), memory=folder / "fits"))


def _found(answer: dict[str, Any]) -> None:
    assert answer["verdict"] == "explained"
    assert answer["added"] == ["enhanced_conditions"]
    assert answer["share"] == pytest.approx(1.0, abs=0.01)
    noise, errors = answer["noise"], answer["rmse"]
    before, after = errors["held-out twice"]
    assert before > 10.0 * noise
    assert after < 1.1 * noise


def test_the_experiment_says_the_wire_is_known(tmp_path: Path) -> None:
    """The loops on it are slow tests; what is wrong with its file shows here."""
    experiment = load_experiment(write(tmp_path, "liang"), CATALOGUE)
    assert not experiment.priors
    assert experiment.parameters["stress_slope_austenite"] == pytest.approx(WIRE.stress_slope_austenite)


@pytest.mark.slow  # the notebook of the same is run by `test_notebooks`, enhanced conditions included
def test_the_stress_rate_is_found_among_similar_effects(tmp_path: Path) -> None:
    """Among the three candidates that leave the most similar traces, and one that everybody thinks of."""
    _found(_closed(tmp_path, "liang", '"enhanced_conditions", "minor_loops", "phase_resistance", "latent_heat"'))


@pytest.mark.slow
def test_the_stress_rate_is_found_among_all_effects(tmp_path: Path) -> None:
    _found(_closed(tmp_path, "liang"))


@pytest.mark.slow
def test_a_wire_with_the_enhanced_conditions_lacks_no_effect(tmp_path: Path) -> None:
    answer = _closed(tmp_path, "enhanced")
    assert (answer["verdict"], answer["added"]) == ("adequate", [])
