"""Judging of the attribution benchmark: what counts as right, and what the tables say of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from studies.attribution_benchmark.judge import Judged, judge, load, save
from studies.attribution_benchmark.tables import (
    bars,
    confusion,
    missed,
    most_alarms,
    precision,
    strength_of,
    text,
    written,
)


def _report(
    verdict: str,
    added: list[str],
    confounders: list[tuple[str, float]] = [],  # noqa: B006
    unknown: str = "",
    or_else: str = "",
) -> dict[str, Any]:
    runs = [
        {"role": role, "rmse_before": before, "rmse_after": after, "samples": 100}
        for role, before, after in (("fit", 9.0, 1.0), ("fit", 12.0, 1.0), ("held-out", 5.0, 1.1))
    ]
    return {
        "verdict": verdict,
        "output": {"noise_sigma": 1.0},
        "runs": runs,
        "effects": [{"name": name, "added": True} for name in added] + [{"name": "radiation", "added": False}],
        "confounders": [{"confounder": name, "weight": weight} for name, weight in confounders],
        "unknown": [
            {"name": "one", "equation": unknown, "named": True, "indistinguishable": ["other"] if or_else else []},
            {"name": "other", "equation": or_else, "named": False, "indistinguishable": []},
        ]
        if unknown
        else [],
    }


def _truth(kind: str, effects: dict[str, str], outside: bool = False, strength: float = 10.0) -> dict[str, Any]:
    return {
        "case": f"rig-{kind}",
        "kind": kind,
        "rig": "rig",
        "strength_asked": 10.0,
        "strength_together": strength,
        "effects": {
            name: {"group": group, "outside": outside, "strength": strength} for name, group in effects.items()
        },
    }


HEAT, STRAIN = {"latent_heat": "heat"}, {"creep": "constitutive"}
CASES = {
    "named": (judge(_truth("single", HEAT), _report("explained", ["latent_heat"]), 1.0), True, True),
    "named beside it": (
        judge(_truth("single", HEAT), _report("explained", ["phase_specific_heat"], [("latent_heat", 0.2)]), 1.0),
        True,
        True,
    ),
    "a confounder of no weight": (
        judge(_truth("single", HEAT), _report("explained", ["phase_specific_heat"], [("latent_heat", 1e-3)]), 1.0),
        False,
        True,
    ),
    "called otherwise": (
        judge(_truth("single", {"dead_band": "sensor"}), _report("explained", ["sensor_backlash"]), 1.0),
        True,
        True,
    ),
    "one of two": (judge(_truth("pair", {**HEAT, **STRAIN}), _report("explained", ["creep"]), 1.0), False, True),
    "overlooked": (judge(_truth("single", HEAT), _report("adequate", []), 1.0), False, False),
    "wrong": (judge(_truth("single", HEAT), _report("explained", ["creep"]), 1.0), False, False),
}


@pytest.mark.parametrize("case", sorted(CASES))
def test_an_answer_counts_as_right_for_its_effect_and_its_equation(case: str) -> None:
    one, effect, equation = CASES[case]
    assert (one.effect_right, one.equation_right) == (effect, equation)


def test_of_drawn_coefficients_the_strength_is_what_a_refit_of_the_base_model_leaves() -> None:
    told: dict[str, Any] = _truth("pair", {**HEAT, **STRAIN})
    for one in (told, *told["effects"].values()):
        one.update({name: None for name in one if name.startswith("strength")})
    one = judge(told, _report("explained", ["creep", "latent_heat"]), 1.0)
    assert one.strength == pytest.approx((one.fit_before**2 - 1.0) ** 0.5)
    assert not one.full
    assert not one.short
    assert one.right


def test_each_kind_has_its_right_answer() -> None:
    foreign = _truth("outside", {"convection_regime": "heat"}, outside=True)
    assert judge(_truth("null", {}, strength=0.0), _report("adequate", []), 1.0).right
    assert not judge(_truth("null", {}, strength=0.0), _report("explained", ["creep"]), 1.0).right
    assert judge(_truth("absorbed", HEAT), _report("adequate", []), 1.0).right
    assert judge(foreign, _report("not in the library", []), 1.0).right
    assert judge(foreign, _report("not in the library", [], unknown="heat"), 1.0).right
    assert not judge(foreign, _report("not in the library", [], unknown="sensor"), 1.0).right
    assert judge(foreign, _report("not in the library", [], unknown="sensor", or_else="heat"), 1.0).right
    assert judge(foreign, _report("partly explained", ["latent_heat"]), 1.0).right
    assert not judge(foreign, _report("explained", ["latent_heat"]), 1.0).right
    assert not judge(foreign, _report("partly explained", ["creep"], unknown="sensor", or_else="heat"), 1.0).right
    # The library has its heat balance by another name.
    clamp = judge(_truth("single", {"clamp_node": "heat"}), _report("explained", ["warmed_surroundings"]), 1.0)
    assert (clamp.kind, clamp.right) == ("single", True)
    # Also of a case that was written when the library had not got it.
    old = _truth("outside", {"clamp_node": "heat"}, outside=True)
    assert judge(old, _report("explained", ["warmed_surroundings"]), 1.0).kind == "single"
    # What the library does not hold is outside of it, whatever the generator calls it.
    assert judge(_truth("single", {"cogging": "mechanics"}), _report("adequate", []), 1.0).kind == "outside"


def test_errors_are_pooled_in_noises_and_kept_whole(tmp_path: Path) -> None:
    one = CASES["named"][0]
    assert one.fit_before == pytest.approx((0.5 * (81.0 + 144.0)) ** 0.5)
    assert one.held_out_before == 5.0
    assert one.held_out_after == pytest.approx(1.1)
    save(one, tmp_path / "one.json")
    assert load(tmp_path / "one.json") == one


def test_the_benchmarks_tables_and_picture_are_written(tmp_path: Path) -> None:
    cases: list[Judged] = [one for one, _, _ in CASES.values()]
    cases.append(judge(_truth("null", {}, strength=0.0), _report("adequate", []), 130.0))
    rows, columns, counts = confusion(cases)
    assert counts[rows.index("heat"), columns.index("heat")] == 3
    assert precision(cases) == "3 of 6 (50 %)"  # latent heat, play, and creep of the pair
    assert most_alarms([cases[-1]] * 75) == pytest.approx(1.0 - 0.025 ** (1.0 / 75.0))
    assert counts[rows.index("heat"), columns.index("nothing")] == 1
    assert counts[rows.index("nothing"), columns.index("nothing")] == 1
    assert {one.case for one in missed(cases)} == {"rig-single", "rig-pair"}
    told = {what: measured for what, _, measured in bars(cases)}
    assert told["both effects of a pair"] == "0 of 1 (0 %)"
    short = replace(CASES["one of two"][0], weakest=2.0)  # ten noises were asked for
    told_with_it = {what: measured for what, _, measured in bars([*cases, short])}
    assert told_with_it["both effects of a pair"] == "0 of 1 (0 %)"
    assert (
        told_with_it["all effects of a pair or triple of which one has less than the strength asked for"]
        == "0 of 1 (0 %)"
    )
    assert told["a case in under two minutes"] == "7 of 8 (88 %)"
    assert told["a case in under three minutes"] == "8 of 8 (100 %)"
    assert strength_of(cases[0]) == 10.0
    # What the generator calls ten noises, and a refit to its end leaves next to nothing of.
    assert strength_of(replace(cases[0], fit_before=1.5)) == 1.0
    assert written(cases, tmp_path) == text(cases)
    assert (tmp_path / "results.png").stat().st_size > 10_000
