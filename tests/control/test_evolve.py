"""CMA-ES without gradients: it comes to the least of the largest, keeps limits, and goes on without running anything again."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from smajax.control.tune import cma_es as module
from smajax.control.tune.cma_es import POPULATION, CmaEsState, SearchTask, evolve, load
from smajax.control.tune.objective import Goal
from smajax.control.tune.scenarios import Scenarios, tuned_on
from smajax.control.tune.terms import TERMS

COLUMNS = list(TERMS)
SCENARIOS = tuned_on([0.0, 30.0], {}, 0)
START = np.asarray([0.9, 0.2])


class Kinks:
    """In the place of closed loops: two whose larger cost has a kink along x = 0.4, least at (0.4, 0.6); overshoot grows with y."""

    def __init__(self) -> None:
        self.simulations = 0

    def rounded(self, points: np.ndarray) -> np.ndarray:
        return points.round(6)

    def evaluate(self, points: np.ndarray, scenarios: Scenarios) -> Any:
        x, y = points.T
        self.simulations += len(points) * scenarios.size
        seen = np.zeros((len(points), 2, len(COLUMNS)))
        bowl = 1.0 + 3.0 * (y - 0.6) ** 2
        seen[:, :, COLUMNS.index("settling_time")] = np.stack([bowl + 20 * (x - 0.4), bowl - 5 * (x - 0.4)], axis=1)
        seen[:, :, COLUMNS.index("overshoot")] = 2.0 * y[:, None]
        return SimpleNamespace(exact=seen)


def searched(goal: Goal, generations: int = 30, **given: Any) -> tuple[CmaEsState, Kinks]:
    rig: Any = Kinks()
    return evolve(SearchTask(rig, goal, SCENARIOS), START, generations=generations, seed=3, **given), rig


def test_the_minimum_of_the_maximum_is_found_at_a_kink() -> None:
    found, rig = searched(Goal(weights={"settling_time": 1.0}))
    np.testing.assert_allclose(found.best, [0.4, 0.6], atol=0.01)
    assert rig.simulations == found.ran[-1] == 30 * POPULATION * SCENARIOS.size


def test_a_limit_takes_precedence_over_the_cost() -> None:
    found, _ = searched(Goal(weights={"settling_time": 1.0}, limits={"overshoot": 0.8}))
    assert found.best[1] <= 0.4
    np.testing.assert_allclose(found.best, [0.4, 0.4], atol=0.02)


def test_a_stopped_search_resumes_without_repeating_simulations(tmp_path: Path) -> None:
    goal = Goal(weights={"settling_time": 1.0})
    whole, _ = searched(goal)
    searched(goal, 12)[0].save(tmp_path / "finish.npz")
    kept: list[int] = []
    found, rig = searched(goal, known=load(tmp_path / "finish.npz"), save=lambda state: kept.append(state.generations))
    np.testing.assert_array_equal(found.points, whole.points)
    np.testing.assert_array_equal(found.ran, whole.ran)
    assert kept == list(range(13, 31))
    assert rig.simulations == 30 * POPULATION * SCENARIOS.size


def test_results_of_another_start_are_not_used() -> None:
    goal = Goal(weights={"settling_time": 1.0})
    other = CmaEsState.none(START + 0.01).after(
        np.full((POPULATION, 2), 0.4), np.zeros(POPULATION), np.zeros(POPULATION), 7
    )
    np.testing.assert_array_equal(searched(goal, 3, known=other)[0].points, searched(goal, 3)[0].points)
    mixed = searched(goal, 3)[0]
    mixed.points[1] += 0.01  # as another version of the search would have asked
    again, _ = searched(goal, 3, known=mixed)
    np.testing.assert_array_equal(again.points, searched(goal, 3)[0].points)


def test_a_converged_search_restarts_around_the_best_point(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[np.ndarray] = []
    search = module._search

    def watched(mean: np.ndarray, seed: int, number: int) -> Any:
        begun.append(mean)
        return search(mean, seed, number)

    monkeypatch.setattr(module, "_search", watched)
    found, _ = searched(Goal(weights={"settling_time": 1.0}), 150)
    assert len(begun) > 2
    np.testing.assert_allclose(begun[-1], [0.4, 0.6], atol=0.02)
    np.testing.assert_allclose(found.best, [0.4, 0.6], atol=0.01)


def test_loops_with_nan_are_ranked_last(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluate = Kinks.evaluate

    def lost(self: Kinks, points: np.ndarray, scenarios: Scenarios) -> Any:
        seen = evaluate(self, points, scenarios)
        seen.exact[points[:, 0] > 0.8] = np.nan
        return seen

    monkeypatch.setattr(Kinks, "evaluate", lost)
    found, _ = searched(Goal(weights={"settling_time": 1.0}))
    np.testing.assert_allclose(found.best, [0.4, 0.6], atol=0.01)


def test_a_damaged_file_is_ignored(tmp_path: Path) -> None:
    (tmp_path / "finish.npz").write_bytes(b"PK\x03\x04 no more")
    assert load(tmp_path / "finish.npz") is None
    assert load(tmp_path / "nothing.npz") is None
