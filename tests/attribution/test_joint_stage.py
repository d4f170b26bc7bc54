"""The joint search as a stage of the loop: what is added, with which probability, and how the page says it."""

from __future__ import annotations

import dataclasses
from importlib import resources

import numpy as np
import pytest

import smajax.attribution.joint_stage
from smajax.attribution.close_loop import close_loop, prepared, searched
from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import Findings, LikelierModel, StepDependent
from smajax.core.progress import quiet
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.model.effects.library import LIBRARY
from smajax.report.html import findings_to_html
from smajax.report.json_file import findings_to_json
from smajax.report.narrative import narrate

FEW = ("latent_heat", "sensor_gain", "radiation")


def _demo(effects: tuple[str, ...], runs: int = 6) -> Experiment:
    with resources.as_file(resources.files("smajax") / "data" / "demo" / "latent") as folder:
        experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    return dataclasses.replace(experiment, effects_only=effects, runs=experiment.runs[:runs])


@pytest.fixture(scope="module")
def latent() -> Findings:
    return close_loop(_demo(FEW))


@pytest.mark.slow
def test_an_effect_that_is_there_is_added_and_all_others_are_unlikely(latent: Findings) -> None:
    assert [effect.name for effect in latent.added] == ["latent_heat"]
    likely = {effect.name: effect.evidence["posterior_probability"] for effect in latent.effects}
    assert likely.pop("latent_heat") > 0.99
    assert np.nanmax([*likely.values(), 0.0]) < 0.5
    assert latent.added[0].evidence["alone_rmse_fit"] == pytest.approx(latent.residual_after.rmse, rel=0.05)


@pytest.mark.slow
def test_the_page_and_the_record_list_the_sets_that_were_compared(latent: Findings) -> None:
    first = latent.rounds[0]
    assert first.chosen == "latent_heat"
    assert isinstance(first.reason, LikelierModel)
    assert first.reason.log_odds > 10.0
    said = narrate(latent).rounds[0]
    assert said.startswith("likelier than the base model by")
    assert "latent_heat (+" in said
    page = findings_to_html(latent)
    assert said in page.replace("&#39;", "'")
    assert "posterior probability" in page
    record = findings_to_json(latent)
    assert [one["added"] for one in record["effects"]].count(True) == 1
    assert record["effects"][0]["evidence"]["posterior_probability"] > 0.99


@pytest.mark.slow
def test_an_effect_that_gains_nothing_at_half_the_step_is_excluded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The latent heat passes for one with which the load jumps; the search is made again without it, and says so."""
    kept = iter((0.1, 1.0))
    candidate = LIBRARY["latent_heat"].candidate
    monkeypatch.setattr(smajax.attribution.joint_stage, "gain_kept_at_half_step", lambda *_: next(kept, 1.0))
    monkeypatch.setattr(
        LIBRARY["latent_heat"],
        "candidate",
        dataclasses.replace(candidate, stick_slip=True),
    )
    context = prepared(_demo(FEW[:2], runs=2), ResultCache(), quiet, 1, AttributionConfig())
    assert "latent_heat" not in searched(context).final.effects
    (excluded,) = [one.reason for one in context.setting.rounds if isinstance(one.reason, StepDependent)]
    assert excluded.effects == "latent_heat"
