"""Single effects that come near to many are fitted to their ends, and sought as soon as many leave more than noise."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest

from smajax.attribution import joint_stage, nearest_alone
from smajax.attribution.nearest_alone import MOST_TIMES, NEAREST
from tests.attribution.test_joint_stage import THREE, _model, _stage_and_search


def _fitted_on(
    monkeypatch: pytest.MonkeyPatch, found: float, falling: dict[str, float]
) -> tuple[dict[str, float], Any]:
    """(what each leaves after it, the names that each call of the fits had): fits by which an effect's error falls by that factor each time."""
    models = {
        name: _model([name], left, 0.0) for name, left in (("a", 2.0), ("b", 2.5), ("c", 2.9), ("d", 2.95), ("e", 9.0))
    }
    search = SimpleNamespace(fitted={(name,): one for name, one in models.items()}, error=lambda _: 1.0, rounds=[])
    for one in models.values():
        one.width_factors = {}
    calls: list[list[str]] = []

    def fit_side_by_side(search: Any, begun: Sequence[Any], error: float, stage: str, compared: bool) -> None:
        assert not compared
        calls.append([one.effects[0] for one in begun])
        for one in begun:
            old = search.fitted[one.effects]
            search.fitted[one.effects] = _model(one.effects, old.rms * falling.get(one.effects[0], 1.0), 0.0)
            search.fitted[one.effects].width_factors = {}

    monkeypatch.setattr(nearest_alone, "fit_side_by_side", fit_side_by_side)
    monkeypatch.setattr(nearest_alone, "stage_of", lambda search, number: "fitting")
    result = nearest_alone.nearest_alone(
        cast(Any, search), cast(Any, list(models.values())), cast(Any, _model(THREE, found, 0.0))
    )
    return {one.effects[0]: one.rms for one in result}, calls


def test_a_fit_that_still_falls_goes_on_and_one_that_does_not_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    left, calls = _fitted_on(monkeypatch, 1.0, {"a": 0.5, "b": 0.99, "e": 0.1})
    assert calls == [["a", "b", "c"], *[["a"]] * (MOST_TIMES - 1)]  # the nearest ones alone
    assert len(calls[0]) == NEAREST
    assert left["a"] == pytest.approx(2.0 * 0.5**MOST_TIMES)
    assert left["e"] == 9.0
    assert set(left) == set("abcde")


def test_what_is_far_behind_is_not_fitted_on(monkeypatch: pytest.MonkeyPatch) -> None:
    _, calls = _fitted_on(monkeypatch, 0.8, {})
    assert calls == [["a"]]
    _, calls = _fitted_on(monkeypatch, 0.5, {})
    assert calls == []


def test_one_effect_is_sought_once_in_the_place_of_many_that_leave_more_than_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    likelier = _model(["sensor_drift"], 1.2, 20.0)
    stage, search, asked = _stage_and_search(monkeypatch, [], [likelier])
    monkeypatch.setattr(joint_stage, "described_alone", lambda search, found: [])
    search.asked_for_one = False
    few, noise, many = _model(THREE[:2], 5.0, 9.0), _model(THREE, 1.0, 9.0), _model(THREE, 5.0, 9.0)
    assert stage.in_place_of_many(search, few) is None
    assert stage.in_place_of_many(search, noise) is None
    assert not search.asked_for_one
    assert stage.in_place_of_many(search, many) is likelier
    assert asked == []  # before unknown functions are
    assert search.asked_for_one
    assert stage.in_place_of_many(search, many) is not likelier


def test_many_effects_that_are_likelier_than_one_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, search, _ = _stage_and_search(monkeypatch, [], [_model(["sensor_drift"], 1.2, 5.0)])
    monkeypatch.setattr(joint_stage, "described_alone", lambda search, found: [])
    search.asked_for_one = False
    assert stage.in_place_of_many(search, _model(THREE, 5.0, 9.0)) is None
