"""Where many effects leave more than noise, every way to describe what one of them describes is fitted alone, to its end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from smajax.attribution import joint_search
from smajax.attribution.joint_search import described_alone


def test_the_shapes_of_the_transformation_are_fitted_alone_beside_one_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[list[str], dict[str, Any]]] = []
    monkeypatch.setattr(joint_search, "_fit_alone", lambda search, effects, error, **how: asked.append((effects, how)))
    names = ("latent_heat", "smooth_transformation", "two_part_transformation", "transformation_curve", "radiation")
    search = SimpleNamespace(
        joint=SimpleNamespace(coefficients=dict.fromkeys(names, ())),
        excluded=frozenset({"smooth_transformation"}),
        trials={},
        fitted={("two_part_transformation",): "its model"},
        error=lambda model: 1.0,
    )

    def alone(*effects: str) -> list[Any]:
        asked.clear()
        return described_alone(cast(Any, search), cast(Any, SimpleNamespace(effects=effects)))

    assert alone("radiation", "transformation_curve", "latent_heat") == ["its model"]
    # However far behind they are on the way.
    assert asked == [(["two_part_transformation", "transformation_curve"], {"compared": False})]
    assert alone("radiation", "latent_heat") == []
    assert asked == [([], {"compared": False})]
    # What was fitted at this error is not fitted again.
    search.trials["two_part_transformation",] = 1.0
    alone("transformation_curve")
    assert asked == [(["transformation_curve"], {"compared": False})]
