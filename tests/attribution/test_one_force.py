"""Effects that depend on the stress are looked for where runs could show them: under more than one force."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.attribution.job import job_of
from smajax.data.open_experiment import open_experiment
from smajax.fit.identifiability import Checks, Identifiability
from smajax.report.identifiability_words import check_sentences
from tests.helpers.small_bench import bench

OF_STRESS = {"unequal_stress_slopes", "stress_dependent_width", "stress_dependent_strain"}
HANGING = 'load = "dead_weight"'
TWO_RUNS = 'role = "held-out"\nfile = "b.csv"'


def test_under_one_weight_what_depends_on_the_stress_is_not_looked_for_and_said(tmp_path: Path) -> None:
    job = job_of(open_experiment(bench(tmp_path)))
    assert set(job.hidden_by_one_force) == OF_STRESS
    assert not OF_STRESS & set(job.candidates)
    assert "latent_heat" in job.candidates
    checks = Checks(Identifiability((), 0, 0), hidden_by_one_force=job.hidden_by_one_force)
    said = check_sentences((), checks)[-1]
    assert "the load pulls with the same force" in said
    assert "unequal stress slopes" in said


@pytest.mark.parametrize(
    "change",
    [
        pytest.param((HANGING, 'load = "bias_spring"'), id="a spring"),
        pytest.param(
            (TWO_RUNS, 'role = "fit"\nfile = "b.csv"\nparameters = { load_mass = "0.2 kg" }'), id="two weights"
        ),
    ],
)
def test_under_more_forces_it_is(tmp_path: Path, change: tuple[str, str]) -> None:
    job = job_of(open_experiment(bench(tmp_path, change)))
    assert set(job.candidates) >= OF_STRESS
    assert not job.hidden_by_one_force
