"""Where many effects leave more than noise, every way to describe what one of them describes is fitted alone, to its end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from smajax.attribution import fits_alone
from smajax.attribution.fits_alone import described_alone

NAMES = ("latent_heat", "smooth_transformation", "two_part_transformation", "transformation_curve", "radiation")


def model(*effects: str, evidence: float = 0.0) -> Any:
    return SimpleNamespace(effects=effects, log_evidence=lambda variance: evidence)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[list[str], dict[str, Any]]]:
    found: list[tuple[list[str], dict[str, Any]]] = []
    monkeypatch.setattr(fits_alone, "_fit_alone", lambda search, effects, error, **how: found.append((effects, how)))
    return found


def search_of(*fitted: Any) -> Any:
    return SimpleNamespace(
        joint=SimpleNamespace(
            coefficients=dict.fromkeys(NAMES, ()), ordered=lambda effects: tuple(n for n in NAMES if n in effects)
        ),
        excluded=frozenset({"smooth_transformation"}),
        trials={},
        fitted={one.effects: one for one in fitted},
        error=lambda model: 1.0,
    )


def test_the_shapes_of_the_transformation_are_fitted_alone_beside_one_of_them(asked: list[Any]) -> None:
    two_part = model("two_part_transformation")
    search = search_of(model(), two_part)

    def alone(*effects: str) -> list[Any]:
        asked.clear()
        return described_alone(search, cast(Any, SimpleNamespace(effects=effects)))

    assert alone("radiation", "transformation_curve", "latent_heat") == [two_part]
    # However far behind they are on the way.
    shapes = ["two_part_transformation", "transformation_curve"]
    assert asked == [(shapes, {"compared": False, "beside": ()})]
    assert alone("radiation", "latent_heat") == []
    assert asked == [([], {"compared": False, "beside": ()})]
    # What was fitted at this error is not fitted again.
    search.trials["two_part_transformation",] = 1.0
    alone("transformation_curve")
    assert asked == [(["transformation_curve"], {"compared": False, "beside": ()})]


def test_they_are_fitted_beside_the_likeliest_few_of_the_others_too(asked: list[Any]) -> None:
    """Not beside another shape, what was not found, or many."""
    heat, both = model("latent_heat", evidence=3.0), model("latent_heat", "transformation_curve", evidence=9.0)
    others = (model("radiation", evidence=1.0), model("two_part_transformation", evidence=8.0), both)
    search = search_of(model(), heat, *others, model("sensor_gain", evidence=7.0))
    models = described_alone(
        search, cast(Any, SimpleNamespace(effects=("latent_heat", "radiation", "transformation_curve")))
    )
    assert [how["beside"] for _, how in asked] == [(), ("latent_heat",)]
    assert [one.effects for one in models] == [("two_part_transformation",), ("latent_heat", "transformation_curve")]
