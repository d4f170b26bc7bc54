"""What a tuning's page says of its limits and of what the gains cost."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from smajax.control.tune.settings import TuneSettings
from smajax.control.tune.terms import TERMS
from smajax.report.narrative import narrate
from smajax.report.tune_page import met, price
from smajax.report.tune_words import plants_sentence


def test_an_error_of_the_ambient_temperature_is_shown_in_kelvin() -> None:
    told = plants_sentence(TuneSettings("vsc3", (0.0,), {"damping": 0.2, "ambient": 0.2}), 20.0)
    assert "damping ±20 %, ambient ±4 K at once" in told


def test_settings_are_narrated_as_findings_are() -> None:
    settings = TuneSettings("pid", (20.0,))
    told = narrate(settings)
    assert told.plants == plants_sentence(settings)
    assert told.held_out == "a set point 5° beside, the plant as believed"
    assert told.goal.startswith("Cost: ")
    assert told.between == settings.between_in_words()


def test_a_term_that_the_gains_worsen_is_reported_with_both_numbers() -> None:
    """Energy by less than half more, chatter four times as much, switches from none to three a second."""
    columns = list(TERMS)
    judged = np.ones((2, 3, len(columns)))
    judged[:, :, columns.index("energy")] = [[40.0], [50.0]]
    judged[:, :, columns.index("chatter")] = [[2.5], [10.0]]
    switches = np.asarray([[0.0, 0.0, 0.0], [2.0, 3.0, 4.0]])

    def tuned(after: int) -> Any:
        seen = SimpleNamespace(
            exact=judged[[0, after]], merits=SimpleNamespace(switches_per_second=switches[[0, after]])
        )
        return SimpleNamespace(checks={"tuned on": SimpleNamespace(seen=seen)})

    (said,) = price(tuned(1))
    assert (
        "chatter of the command from 2.5 to 10 V/s in the median loop; switches of the command from 0 to 3 a second"
        in said
    )
    assert "energy" not in said
    assert price(tuned(0)) == []


def test_a_limit_met_without_settling_is_reported() -> None:
    settles, never = [2.0, 2.5], [np.inf, np.inf]

    def told(before: list[float], after: list[float], limits: dict[str, float]) -> str:
        seen = SimpleNamespace(merits=SimpleNamespace(settling_time=np.asarray([before, after])))
        found: Any = SimpleNamespace(settings=SimpleNamespace(limits=limits))
        check: Any = SimpleNamespace(scenarios=SimpleNamespace(size=2), seen=seen)
        return met(found, check, "tuned on")

    overshoot, both = {"overshoot": 0.1}, {"overshoot": 0.1, "settling_time": 4.0}
    plain = "Every limit is met in all 2 closed loops tuned on"
    assert told(settles, settles, overshoot) == f"{plain}."
    assert told(settles, settles, both) == f"{plain}."
    assert told(settles, never, overshoot).startswith(f"{plain}, but none of them settles (2 with the preset's gains)")
    assert "but only 1 of them settles (2 with" in told(settles, [2.0, np.inf], overshoot)
    assert "none of them settles (0 with" in told(never, never, overshoot)
