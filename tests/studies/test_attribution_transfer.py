"""The transfer study: what is found in whole cycles of a coupon predicts partial loops and another load, as the true effect does."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from smajax.core.files import replace as replace_file
from studies.attribution_benchmark.cases import Case
from studies.attribution_benchmark.rigs import RIGS
from studies.attribution_benchmark.transfer import FRESH, JudgedRun, Transferred, load, scored, transfer_cases
from studies.attribution_benchmark.transfer_runs import KINDS, kind_of, transfer_rig
from studies.attribution_benchmark.transfer_tables import text

MISMATCH = Case("coupon", ("elastic_mismatch",), 10.0, FRESH + 1)
THINNED = 8


@pytest.mark.parametrize("name", sorted(RIGS))
def test_a_rig_is_fitted_to_steps_and_judged_on_other_kinds(name: str) -> None:
    rig = transfer_rig(name)
    runs = rig.runs(rig.wire)
    assert [run.role for run in runs].count("fit") == 3
    judged = [kind_of(run.name) for run in runs if run.role != "fit"]
    assert set(judged) <= set(KINDS)
    assert ("half the power" in judged) == (rig.load is not None)
    assert ("another load" in judged) == (name in ("coupon", "dead_weight"))
    assert all(run.command.shape == (rig.clock.count,) for run in runs)
    by_name = {run.name: run.command for run in runs}
    if rig.load is not None:
        power = by_name["half_the_power"] ** (1 if rig.wire.drive == "duty" else 2)
        whole = by_name["steps"] ** (1 if rig.wire.drive == "duty" else 2)
        np.testing.assert_allclose(power, 0.5 * whole)
        assert len(np.unique(by_name["steps"])) < 6 < len(np.unique(by_name["ramps"]))


def test_an_effect_that_is_found_predicts_other_runs_as_the_true_one_does(tmp_path: Path) -> None:
    one = scored(MISMATCH, tmp_path, THINNED, ("elastic_mismatch", "minor_loops"))
    assert one.added == ("elastic_mismatch",)
    assert {run.kind for run in one.runs} == {"partial loops", "another load"}
    for run in one.runs:
        assert run.oracle is not None
        assert run.average < 1.2 * run.oracle < 2.0
        assert run.base > 1.5 * run.average
        assert 0.8 < run.coverage <= 1.0
    assert (
        max(run.base for run in one.runs) > 5.0
    )  # what the base model, fitted to whole cycles, makes of another stress
    path = tmp_path / "one.json"
    replace_file(path, json.dumps(asdict(one)))
    assert load(path) == one


def test_every_beginning_of_the_cases_has_all_rigs() -> None:
    cases = transfer_cases()
    assert len({case.name for case in cases}) == len(cases) > 150
    assert all(case.fresh for case in cases)
    assert {case.rig for case in cases[:20]} == set(RIGS)
    fast = transfer_cases(fast=True)
    assert {case.rig for case in fast} == {"coupon"}
    assert {case.effects == () for case in fast} == {True, False}


def test_the_table_counts_what_transfers() -> None:
    good = JudgedRun("ramps", 10.0, 1.1, 1.0, 0.9, 100)
    runs = (good, replace(good, kind="another load", average=12.0, coverage=0.5), replace(good, oracle=None))
    case = Transferred("arm-x", "arm", ("x",), 10.0, "explained", ("y",), 30.0, runs)
    null = Transferred("arm-null", "arm", (), 0.0, "adequate", (), 10.0, (replace(good, base=1.0, average=1.0),))
    lines = {line.split(" | ")[0].strip("| "): line.split(" | ") for line in text([case, null]).splitlines()}
    assert lines["ramps"][1:3] == ["3", "2 of 2 (100%)"]
    assert lines["another load"][1:3] == ["1", "0 of 1 (0%)"]
    assert lines["all"][5] == "1 of 4 (25%)"  # worse than the base model
    assert lines["all"][6] == "80.0% |"
    assert lines["all, nothing missing"][1] == "1"
    assert "arm-x: another load, 12.00 noises, oracle 1.00, base model 10.00; explained y" in text([case, null])
    assert "half the power" not in lines
