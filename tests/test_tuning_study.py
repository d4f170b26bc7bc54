"""The study of tuning in its fast setting: every search keeps to its budget, and the requirement is judged on all loops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.control_presets import CONTROLLERS
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
def test_the_requirement_is_judged_on_every_set_point_and_plant(results: Path) -> None:
    run.require(results, ["vsc3"], run.FAST_EFFORT, again=False)
    found = kept(results)["requirement"]["vsc3"]
    members = requirement.judged_on(run.FAST_EFFORT)
    assert found["after"]["loops"] == members.size == 2 * (1 + 8 + 2)
    assert found["met"] == (found["after"]["loops_that_meet_all"] == members.size)
    assert found["limit_exceeded_by_share"]["after"] <= found["limit_exceeded_by_share"]["before"] + 1e-9


def test_what_is_kept_is_not_run_again(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("run again")

    monkeypatch.setattr(run, "searched", never)
    run.compare(results, (run.FAST_PROBLEM,), CANDIDATES, again=False, seeds_of=run.FAST_WAYS)


def test_the_kept_results_are_whole() -> None:
    """The README's tables are of these: every problem by every way, and every controller."""
    whole = kept(record.HERE / "results.json")
    names = {f"{one.name}; {way}; {seed}" for one in PROBLEMS for way, seeds in run.WAYS.items() for seed in seeds}
    assert set(whole["peers"]) == names
    assert set(whole["requirement"]) == set(CONTROLLERS)
    assert len(picture.draw(whole)) > 1000
    gains = {one.stem for one in (record.HERE / "gains").glob("*.json")}
    assert gains == set(CONTROLLERS)
