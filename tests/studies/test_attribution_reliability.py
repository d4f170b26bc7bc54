"""Whether probabilities of effects are as often right as they say: counting, bins, table and picture."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from studies.attribution_benchmark.judge import Judged, save
from studies.attribution_benchmark.reliability import Given, bins, given, interval, read, text
from studies.attribution_benchmark.reliability import picture as draw

CASE = Judged(
    case="rig-one",
    kind="single",
    rig="rig",
    asked=3.0,
    strength=3.0,
    truth=("smooth_transformation",),
    equations=("kinetics",),
    verdict="explained",
    added=(),
    named=(),
    where=(),
    fit_before=9.0,
    fit_after=1.0,
    held_out_before=5.0,
    held_out_after=1.1,
    seconds=7.0,
)


def _report(**probabilities: float | None) -> dict[str, Any]:
    effects = [{"name": name, "evidence": {"posterior_probability": one}} for name, one in probabilities.items()]
    return {"effects": [*effects, {"name": "radiation", "evidence": None}]}


def test_names_of_one_true_effect_count_once_and_what_was_worth_no_fit_not_at_all() -> None:
    report = _report(two_step_transformation=0.7, transformation_curve=0.25, latent_heat=0.1, creep=None)
    shape, latent = given(CASE, report)
    assert (shape.effect, shape.there) == ("smooth_transformation", True)
    assert shape.probability == pytest.approx(0.95)
    assert latent == Given("rig-one", "latent_heat", 0.1, False)
    # A true effect that no set of the search had was given no probability, and is in no bin.
    missed, latent = given(CASE, _report(latent_heat=0.1))
    assert math.isnan(missed.probability)
    assert sum(one.count for one in bins([missed, latent])) == 1
    assert "In no set of effects that was worth a fit: 1 of 1 true effects." in text([missed, latent])


def test_the_bins_hold_every_effect_once_with_the_share_that_is_there() -> None:
    effects = [Given("a", "b", one, there) for one, there in ((0.0, False), (0.8, True), (0.9, False), (1.0, True))]
    found = bins(effects)
    assert sum(one.count for one in found) == len(effects)
    middle = next(one for one in found if one.low == 0.8)
    assert (middle.count, middle.there) == (2, 1)
    assert middle.mean == pytest.approx(0.85)
    assert found[-1].there == found[-1].count == 1
    # Clopper and Pearson's interval of none of n is 1 - 0.025^(1/n).
    assert interval(0, 10) == pytest.approx((0.0, 1.0 - 0.025**0.1))
    assert interval(10, 10) == pytest.approx((0.025**0.1, 1.0))


def test_judged_cases_are_read_but_for_effects_that_no_answer_could_name(tmp_path: Path) -> None:
    for folder in ("judged", "reports"):
        (tmp_path / folder).mkdir()
    others = (replace(CASE, case=f"rig-{kind}", kind=kind) for kind in ("outside", "absorbed"))
    for one in (CASE, *others):
        save(one, tmp_path / "judged" / f"{one.case}.json")
        record = _report(smooth_transformation=0.99, latent_heat=0.6)
        (tmp_path / "reports" / f"{one.case}.json").write_text(json.dumps(record), encoding="utf-8")
    found = read([tmp_path])
    assert {one.case for one in found} == {"rig-one"}
    said = text(found)
    assert "| 0.95 to 0.999 | 1 | 0.990 | 1 (100.0%) | 2.5% to 100.0% |" in said
    assert "- rig-one: `latent_heat` 0.600" in said
    draw(found, tmp_path / "reliability.png")
    assert (tmp_path / "reliability.png").stat().st_size > 1000
