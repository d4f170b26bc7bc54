"""The curve of the transformation in words."""

from __future__ import annotations

import pytest

from smajax.report.narrative.curve import curve_sentences

NAME = "transformation_curve"


def test_the_cosine_is_called_the_cosine_and_other_effects_have_no_such_words() -> None:
    heating, cooling = curve_sentences(NAME, {})
    assert heating.startswith("On heating the transformation is like the cosine (its first tenth takes 1.0 times ")
    assert cooling.startswith("On cooling the transformation is like the cosine")
    assert curve_sentences("latent_heat", {"enthalpy": 1e4}) == ()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"finish_outer": 0.5}, "ends smoothly"),
        ({"finish_outer": 1.5}, "ends with a long tail"),
        ({"start_outer": 0.5}, "starts smoothly"),
        ({"finish_outer": -1.5}, "ends sharply"),
        ({"start_inner": 0.8}, "starts smoothly, ends sharply and is slower in its first half than in its second"),
        ({"finish_inner": 0.8}, "starts sharply, ends smoothly and is faster in its first half than in its second"),
        (
            {"finish_inner": 2.0, "finish_middle": -2.0},
            "starts sharply; ends sharply; is faster in its first half than in its second and goes in two steps, the first with about 75% of it",
        ),
    ],
)
@pytest.mark.parametrize("branch", ["heating", "cooling"])
def test_each_shape_has_its_words_on_its_own_branch(branch: str, values: dict[str, float], said: str) -> None:
    sentences = curve_sentences(NAME, {f"{branch}_{name}": value for name, value in values.items()})
    of_branch, other = sentences if branch == "heating" else sentences[::-1]
    assert of_branch.split(" (")[0] == f"On {branch} the transformation {said}"
    assert "is like the cosine" in other


def test_long_tails_of_both_branches_are_a_caution() -> None:
    tails = {"heating_start_outer": 1.5, "cooling_finish_outer": 1.5}
    *_, caution = curve_sentences(NAME, tails)
    assert caution.startswith("Where long tails of heating and cooling overlap")
    assert len(curve_sentences(NAME, {"heating_start_outer": 1.5})) == 2
