"""Why a round of the search ended so, in words."""

from __future__ import annotations

import pytest

from smajax.attribution.reasons import (
    HeldOutWorse,
    LikelierModel,
    NoiseWithoutEffects,
    NoiseWithoutRun,
    NoLikelierModel,
    PredictsTooLittle,
    Reason,
    StepDependent,
    UnknownTermLikelier,
)
from smajax.report.narrative.rounds import reason_text


@pytest.mark.parametrize(
    ("reason", "text"),
    [
        (StepDependent("drag", -0.2), "drag keeps 0% of its gain at half the step and is not accepted"),
        (
            LikelierModel("", 12.34, (("drag", 12.34, 2e-4),)),
            "likelier than the base model by 12.3 in log odds (230,000 to 1); fitted: drag (+12.3, error 0.2 mm)",
        ),
        (NoLikelierModel(()), "no other set of effects is likelier; none was worth a fit"),
        (
            PredictsTooLittle(0.2, 0.5),
            "set aside: with it the model explains 20% of the motion in runs left out, and under 50% an effect means nothing",
        ),
        (
            NoiseWithoutEffects(0.84),
            "set aside: what is left without it is noise as well, and the model found is likelier by 0.8 in log odds (2.3 to 1) only",
        ),
        (NoiseWithoutRun("a"), "set aside: without a what the base model leaves is noise"),
        (
            UnknownTermLikelier("a loss", 12.34),
            "set aside: a loss alone is likelier than all of them by 12.3 in log odds (230,000 to 1)",
        ),
        (HeldOutWorse(1e-3, 2e-3), "set aside: error on the held-out runs 1 mm without and 2 mm with it"),
    ],
)
def test_the_reason_why_the_search_ended_is_reported(reason: Reason, text: str) -> None:
    assert reason_text(reason, "m", "position") == text


def test_of_many_sets_that_were_fitted_a_line_has_the_likeliest() -> None:
    compared = (("creep", -2.0, 3e-4), ("drag", 5.0, 2e-4), ("", -9.0, 4e-4), ("slack", -1.0, 3e-4))
    reason = LikelierModel("", 5.0, compared)
    begun = "likelier than the base model by 5.0 in log odds (150 to 1); fitted: "
    line = reason_text(reason, "m", "position", 2)
    assert line == f"{begun}drag (+5.0, error 0.2 mm), slack (-1.0, error 0.3 mm) and 2 less likely ones"
    assert reason_text(reason, "m", "position").startswith(f"{begun}creep (-2.0, error 0.3 mm), drag")
    assert "less likely" not in reason_text(reason, "m", "position", 4)
