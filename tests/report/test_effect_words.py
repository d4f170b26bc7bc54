"""What the coefficients of an effect say beyond that it is there."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import pytest

from smajax.attribution.findings import CoefficientFinding, Findings
from smajax.fit.identify_result import FitEnd
from smajax.fit.levenberg_marquardt import Status
from smajax.model.effects.library import LIBRARY
from smajax.report.effect_words import meaning, sign_sentences
from smajax.report.html import findings_to_html
from smajax.report.identify_words import ended_sentence, of_effects
from smajax.report.narrative import narrate
from tests.helpers.made_findings import made_effect, made_findings

FALLS = LIBRARY["stribeck_friction"].candidate.sentence


@pytest.mark.parametrize(
    ("sliding", "error", "plain"), [(0.97, 0.05, True), (0.9, 0.05, False), (1.0, None, True), (0.9, None, False)]
)
def test_friction_that_does_not_fall_with_the_speed_is_called_the_plain_one(
    sliding: float, error: float | None, plain: bool
) -> None:
    said = meaning("stribeck_friction", {"limit": (0.3, 0.01), "sliding": (sliding, error)})
    assert ("this is plain Coulomb friction, and the speed" in said) == plain
    assert (said == FALLS) != plain
    grown = meaning("pulley_stribeck_friction", {"sliding": (sliding, error)})
    assert ("plain Coulomb friction, which grows with the load" in grown) == plain
    assert meaning("stribeck_friction", {}) == FALLS


@pytest.mark.parametrize(
    ("heating", "cooling", "said"), [(-1e-10, -2e-10, "fewer"), (-1e-10, 2e-10, "more"), (1e-9, 0.0, "more")]
)
def test_an_effect_below_zero_is_said_the_other_way_round(heating: float, cooling: float, said: str) -> None:
    fitted = {"heating": (heating, None), "cooling": (cooling, None)}
    assert f"{said} degrees" in meaning("stress_dependent_width", fitted)


def with_effect(name: str, **coefficients: CoefficientFinding) -> Findings:
    found = made_effect(name, LIBRARY[name].candidate.title, "mechanics", 2.04e-5, added=True)
    return dataclasses.replace(made_findings(), effects=(dataclasses.replace(found, coefficients=dict(coefficients)),))


def test_page_and_summary_say_it_in_the_place_of_the_sentence_of_the_effect(blank_pictures: None) -> None:
    friction = with_effect(
        "stribeck_friction", limit=CoefficientFinding(0.3, 0.01, "N"), sliding=CoefficientFinding(0.99, 0.04, "-")
    )
    page, summary = findings_to_html(friction), " ".join(narrate(friction).summary)
    assert "sliding, is 0.990 ± 0.040): this is plain Coulomb friction" in summary
    assert "this is plain Coulomb friction" in page
    assert FALLS not in summary
    assert FALLS not in page


def test_a_negative_delay_is_said_to_be_a_clock_s() -> None:
    early = "The delay is negative: what the log has of the input acted 40 ms before the time that it has there."
    summary = " ".join(narrate(with_effect("input_delay", delay=CoefficientFinding(-0.04, 0.002, "s"))).summary)
    assert f"{early} The clock of the command is late by that, or that of the sensor early." in summary
    assert not sign_sentences("input_delay", {"delay": (0.04, 0.002)})
    assert not sign_sentences("sensor_lag", {"delay": (-0.04, 0.002)})
    # Of `identify`, which may have it as an unknown.
    estimate: Any = SimpleNamespace(name="input_delay.delay", value=-0.04, standard_error=0.002)
    other: Any = SimpleNamespace(name="convection_coefficient", value=90.0, standard_error=1.0)
    (said,) = of_effects([estimate, other])
    assert said.startswith(early)


def test_the_end_of_a_single_fit_is_compared_with_no_other() -> None:
    end = FitEnd(Status.CONVERGED, 12, 100, 1e-8, fits=1, same_cost=1)
    assert ended_sentence(end).endswith("It is the only fit that was run until its end.")
    both = ended_sentence(dataclasses.replace(end, fits=3, same_cost=2))
    assert both.endswith(
        "Of the 3 fits that were run to their end 2 ended at the least cost, the others at a higher one."
    )
