"""Where many effects leave more than noise, every way to describe what one of them describes is fitted alone, to its end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from smajax.attribution import fits_alone
from smajax.attribution.fits_alone import described_alone
from smajax.attribution.joint_search import search_jointly
from tests.helpers.hot_weight import hot_weight

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


def test_they_are_fitted_beside_the_likeliest_other_effect_too(asked: list[Any]) -> None:
    """Not beside another shape, what was not found, or two: with three effects these would be the rest of what was found."""
    heat, both = model("latent_heat", evidence=3.0), model("latent_heat", "transformation_curve", evidence=9.0)
    others = (
        model("latent_heat", "radiation", evidence=8.5),
        model("radiation", evidence=1.0),
        model("two_part_transformation", evidence=8.0),
        both,
    )
    search = search_of(model(), heat, *others, model("sensor_gain", evidence=7.0))
    models = described_alone(
        search, cast(Any, SimpleNamespace(effects=("latent_heat", "radiation", "transformation_curve")))
    )
    assert [how["beside"] for _, how in asked] == [(), ("latent_heat",)]
    assert [one.effects for one in models] == [("two_part_transformation",), ("latent_heat", "transformation_curve")]


def test_a_fit_beside_an_effect_begins_with_that_effect() -> None:
    search = hot_weight({"latent_heat.enthalpy": 1.2e4, "phase_resistance.contrast": 0.2})
    found = search_jointly(search, {(): search.joint.problem.start_values()})
    assert set(found.effects) == {"latent_heat", "phase_resistance"}
    both = search.joint.ordered(found.effects)
    heat = search.fitted.get(("latent_heat",)) or fits_alone.fitted_alone(search, ["latent_heat"], search.noise)[0]
    del search.fitted[both]
    fits_alone._fit_alone(search, ["phase_resistance"], search.noise, beside=heat.effects)
    again = search.fitted[both]
    assert again.rms == pytest.approx(found.rms, rel=0.01)
    assert again.values[search.joint.slots["latent_heat.enthalpy"]] == pytest.approx(1.2e4, rel=0.1)
