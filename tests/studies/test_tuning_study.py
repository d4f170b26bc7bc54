"""The study of tuning in its fast setting: every search keeps to its budget, and the requirement is judged on all loops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.control.presets import OF_THE_SOURCE
from studies.tuning import picture, record, requirement, run
from studies.tuning.peers import PROBLEMS
from studies.tuning.record import kept

CANDIDATES = 12


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("study") / "fast.json"
    run.compare(path, (run.FAST_PROBLEM,), CANDIDATES, again=False, seeds_of=run.FAST_WAYS)
    return path


def test_every_search_keeps_to_its_budget_and_never_worsens(results: Path) -> None:
    found = kept(results)["peers"]
    assert len(found) == sum(len(seeds) for seeds in run.FAST_WAYS.values())
    for one in found.values():
        loops, costs = np.asarray(one["course"]).T
        assert one["closed_loops"] <= CANDIDATES * len(run.FAST_PROBLEM.set_points) + len(loops)
        assert (np.diff(loops) > 0.0).all()
        assert (np.diff(costs) < 0.0).all()


@pytest.mark.slow
def test_the_requirement_is_judged_on_loops_that_nothing_has_touched(results: Path) -> None:
    run.require(results, ["vsc3"], run.FAST_PLAN, again=False)
    found = kept(results)["requirement"]["vsc3"]
    members, drawn = requirement.judged_on(run.FAST_PLAN)
    assert found["after"]["loops"] == members.size == 9 + run.FAST_PLAN.drawn
    assert found["after_at_the_corners"]["loops"] == 9 == int((~drawn).sum())
    assert found["met"] <= (found["after"]["loops_that_meet_all"] == members.size)
    assert found["passes"] >= 1
    assert sorted(one.name for one in (record.HERE / "gains").iterdir()) == [
        f"{one}.json" for one in sorted(OF_THE_SOURCE)
    ]


def test_loops_that_judge_are_none_of_those_that_gains_are_tuned_on_or_chosen_by() -> None:
    plan = requirement.Plan()
    asked, (judged, drawn) = requirement.asked_by(plan), requirement.judged_on(plan)
    touched = {tuple(row) for row in asked.rows.round(9)}
    assert not touched & {tuple(row) for row in judged.rows.round(9)}
    assert set(plan.set_points) <= set(np.degrees(asked.targets).round(9))
    assert asked.size == 126 * 9
    assert int((~drawn).sum()) == 125 * 9
    some = judged.rows[drawn]
    varied = some[:, [requirement._column(name) for name in requirement.VARIATION]]
    assert np.abs(varied - 1.0).max() <= 0.2
    assert np.ptp(varied, axis=0) == pytest.approx(0.4, abs=0.01)
    assert np.ptp(np.degrees(some[:, -1])) == pytest.approx(125.0, abs=0.5)
    rest = np.delete(some[:, :-1], [requirement._column(name) for name in requirement.VARIATION], axis=1)
    assert (rest == 1.0).all()


def test_set_points_that_are_added_are_the_worst_and_apart() -> None:
    members = requirement.asked_by(requirement.Plan())
    angles = np.degrees(members.targets)
    over = np.where(np.abs(angles - 66.0) < 5.5, 1.0 - 0.1 * np.abs(angles - 66.0), -0.1)
    over[np.isclose(angles, -38.0)] = 0.2
    assert requirement._added(over, members) == pytest.approx([66.0, 63.0, 69.0, -38.0])


def test_the_worst_plant_is_the_one_that_fails_at_most_set_points() -> None:
    members = requirement.asked_by(requirement.Plan())
    column = requirement._column("convection")
    over = np.where((members.rows[:, column] == 1.2) & (members.targets > 0.0), 0.1, -0.1)
    over[members.rows[:, requirement._column("inertia")] == 0.8] = -0.1
    over[(members.rows[:, requirement._column("damping")] == 0.8) & (members.targets > 0.5)] = -0.1
    told = requirement._worst_plant(over, members)
    assert told["ratios"] == {"inertia": 1.2, "damping": 1.2, "convection": 1.2}
    assert (told["fails"], told["of"]) == (85, 126)


def test_stored_results_are_not_computed_again(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("run again")

    monkeypatch.setattr(run, "searched", never)
    run.compare(results, (run.FAST_PROBLEM,), CANDIDATES, again=False, seeds_of=run.FAST_WAYS)


def test_the_stored_results_are_complete() -> None:
    """The README's tables are of these: every problem by every way, and every controller."""
    whole = kept(record.HERE / "results.json")
    names = {f"{one.name}; {way}; {seed}" for one in PROBLEMS for way, seeds in run.WAYS.items() for seed in seeds}
    assert set(whole["peers"]) == names
    assert set(whole["requirement"]) == set(OF_THE_SOURCE)
    assert len(picture.draw(whole)) > 1000
    gains = {one.stem for one in (record.HERE / "gains").glob("*.json")}
    assert gains == set(OF_THE_SOURCE)
