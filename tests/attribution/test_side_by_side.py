"""A set is fitted on until its fit ended at about the error that others are held against it with."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from smajax.attribution import side_by_side
from smajax.attribution.side_by_side import LOOSELY, fit_continued


@pytest.mark.parametrize(
    ("before", "left", "errors"),
    [
        (1.0, [0.005, 0.0049], [0.02, 0.005]),  # once more where it came down that much further
        (1.0, [0.02], [0.02]),
        (0.03, [], []),  # its fit ended at little more than the present error
        (None, [], []),  # nor where it was no fit
    ],
)
def test_a_fit_that_ended_at_a_far_larger_error_is_continued(
    monkeypatch: pytest.MonkeyPatch, before: float | None, left: list[float], errors: list[float]
) -> None:
    effects = ("latent_heat",)

    def model(error: float) -> Any:
        return SimpleNamespace(effects=effects, values=None, width_factors={}, error=error)

    def fit_side_by_side(search: Any, begun: Any, error: float, stage: str, compared: bool) -> None:
        (one,) = begun
        assert one.effects == effects
        assert not compared  # to its end
        fitted_at.append(error)
        search.trials[effects] = error
        search.fitted[effects] = model(left.pop(0))

    fitted_at: list[float] = []
    monkeypatch.setattr(side_by_side, "fit_side_by_side", fit_side_by_side)
    first = model(0.02)
    search = SimpleNamespace(
        trials={} if before is None else {effects: before}, fitted={effects: first}, error=lambda one: one.error
    )
    assert LOOSELY == 2.0
    found = fit_continued(cast(Any, search), first, 0.02, "a stage")
    assert (fitted_at, left) == (errors, [])
    assert found is search.fitted[effects]
    assert search.trials.get(effects, 0.0) <= LOOSELY * found.error
