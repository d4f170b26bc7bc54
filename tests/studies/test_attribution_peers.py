"""Peers of the attribution benchmark: what they are handed, what their answers count for, and the table of all."""

from __future__ import annotations

import dataclasses
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from smajax.model.effects.library import LIBRARY
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.judge import Judged, save
from studies.attribution_benchmark.peers import run as peers_run
from studies.attribution_benchmark.peers.answer import Answer, judged, load
from studies.attribution_benchmark.peers.answer import save as save_answer
from studies.attribution_benchmark.peers.bench import Bench, opened
from studies.attribution_benchmark.peers.given import Given, Series, error
from studies.attribution_benchmark.peers.given import load as load_given
from studies.attribution_benchmark.peers.given import save as save_given
from studies.attribution_benchmark.peers.greedy import grown, starts_of
from studies.attribution_benchmark.peers.handed import PACKAGE, PYTHONS, given_of, told_by
from studies.attribution_benchmark.peers.plain import fit_of, refitted
from studies.attribution_benchmark.peers.sindy_peer import equation_of, states_of
from studies.attribution_benchmark.peers.table import HEAD, beaten, gathered, line, needless, text
from studies.attribution_benchmark.write import write
from studies.benchmarks.peers import run_peer

CASE = "coupon-thermal_expansion-10-02"
FEW = ("thermal_expansion", "sensor_gain")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("cases")
    write(next(case for case in cases() if case.name == CASE), out)
    return out / CASE


@pytest.fixture(scope="module")
def bench(folder: Path) -> Bench:
    whole = opened(folder)
    # Two candidates of the library, so that a refit is soon compiled.
    few = {role: dataclasses.replace(getattr(whole, role), candidates=FEW) for role in ("fits", "held_out")}
    return dataclasses.replace(whole, **few)


@pytest.fixture(scope="module")
def base(bench: Bench) -> Answer:
    return refitted(bench, CASE)


def _truth(kind: str = "single", **effects: str) -> dict[str, Any]:
    return {
        "case": f"rig-{kind}",
        "kind": kind,
        "rig": "rig",
        "strength_asked": 10.0,
        "strength_together": 10.0 if effects else 0.0,
        "effects": {name: {"group": group, "outside": False} for name, group in effects.items()},
    }


PLAIN = Answer("plain", "rig-single", fit_error=9.0, held_out_error=8.0, seconds=1.0)


def test_greedy_adds_what_lowers_the_held_out_error_most(bench: Bench, base: Answer) -> None:
    first = grown(bench, fit_of(bench, base), most=1)
    assert first.effects == ("thermal_expansion",)
    assert first.tried == len(FEW)
    assert first.held_out_error < 0.3 * base.held_out_error
    assert bench.errors([first.values], FEW)[0] == pytest.approx((first.fit_error, first.held_out_error))
    sides = {
        start.values[bench.fits.problem.names.index("sensor_gain.error")] > 0.0
        for start in starts_of(bench, _present(bench, base), "sensor_gain")
    }
    assert sides == {True, False}


def _present(bench: Bench, base: Answer) -> Any:
    from studies.attribution_benchmark.peers.greedy import model_of

    return model_of((), fit_of(bench, base))


def test_what_a_peer_is_handed_leaves_out_what_is_true(bench: Bench, base: Answer, tmp_path: Path) -> None:
    save_given(tmp_path / "given.npz", given_of(bench, base))
    given = load_given(tmp_path / "given.npz")
    fit, unseen = ([run.residual for run in given.runs if run.fitted is role] for role in (True, False))
    assert error([(one, np.zeros_like(one)) for one in fit]) == pytest.approx(base.fit_error, rel=1e-6)
    assert error([(one, np.zeros_like(one)) for one in unseen]) == pytest.approx(base.held_out_error, rel=1e-6)
    assert all(abs(run.residual.mean()) < 1e-6 for run in given.runs)
    assert set(given.runs[0].inputs) == {"temperature", "stress"}
    with np.load(tmp_path / "given.npz") as kept:
        assert not [name for name in kept.files if any(effect in name for effect in LIBRARY)]


def test_an_answer_is_stored_whole(tmp_path: Path) -> None:
    one = dataclasses.replace(PLAIN, added=("creep",), values={"specific_heat": 0.1})
    save_answer(one, tmp_path / "new" / "one.json")
    assert load(tmp_path / "new" / "one.json") == one
    save_answer(Answer("pysindy", "rig", reason="none"), tmp_path / "none.json")
    assert math.isnan(load(tmp_path / "none.json").held_out_error)


def test_an_answer_counts_as_the_loops_would() -> None:
    heat = _truth(latent_heat="heat")
    right = judged(heat, Answer("greedy", "c", ("latent_heat", "creep"), ("heat", "constitutive"), False), PLAIN)
    assert (right.right, right.equation_right, needless(right), right.held_out_before) == (True, True, 1, 8.0)
    other = judged(heat, Answer("greedy", "c", ("creep", "radiation"), ("constitutive", "heat"), False), PLAIN)
    assert (other.right, other.equation_right) == (False, False)
    assert judged(heat, Answer("pysindy", "c", (), ("heat",), False), PLAIN).equation_right
    null = _truth("null")
    assert judged(null, Answer("greedy", "c", adequate=True), PLAIN).right
    assert not judged(null, Answer("pysindy", "c", adequate=False), PLAIN).right
    assert judged(null, PLAIN, PLAIN).verdict == "none"


@pytest.mark.parametrize(
    ("states", "coupon", "equation"),
    [
        ("output", False, "sensor"),
        ("output output_rate", True, "sensor"),
        ("time", False, "sensor"),
        ("temperature stress", True, "constitutive"),
        ("martensite_fraction martensite_fraction_rate", False, "kinetics"),
        ("temperature_rate", False, "heat"),
        ("temperature_rate", True, "input"),
        ("command", False, "electrical"),
        ("command", True, ""),
        ("time temperature", False, ""),
        ("", False, ""),
    ],
)
def test_a_term_points_to_an_equation_where_its_states_do(states: str, coupon: bool, equation: str) -> None:
    assert equation_of(frozenset(states.split()), coupon) == equation


def _series(name: str, fitted: bool, seed: int, weight: float) -> Series:
    """A residual of `weight` noises a deviation of the fraction, in white noise."""
    random, time = np.random.default_rng(seed), np.linspace(0.0, 6.0, 201)
    fraction = 0.5 + 0.5 * np.sin((1.0 + 0.2 * seed) * time + seed)
    temperature = 60.0 + 20.0 * np.cos((1.3 + 0.1 * seed) * time)
    base = 300.0 * np.sin(2.1 * time + seed)
    left = weight * (fraction - 0.5) + random.normal(0.0, 1.0, len(time))
    states = {"temperature": temperature, "stress": np.full(201, 1e8), "martensite_fraction": fraction}
    return Series(name, fitted, {"temperature": temperature}, base + left - left.mean(), base, states)


def _given(weight: float) -> Given:
    return Given("coupon", 0.03, tuple(_series(f"run {k}", k < 4, k, weight) for k in range(6)))


def test_states_are_scaled_and_unique() -> None:
    names, states = states_of(_given(0.0))
    # The command of a coupon is its temperature; a constant stress says nothing.
    assert {"temperature", "martensite_fraction", "output", "time"} <= set(names)
    assert not {"command", "stress", "stress_rate"} & set(names)
    fitted = np.concatenate(states[:4])
    assert np.allclose(fitted.mean(axis=0), 0.0, atol=1e-9)
    assert np.allclose(fitted.std(axis=0), 1.0)


def _python(peer: str) -> str:
    python = os.environ.get(PYTHONS[peer][1])
    if not python:
        pytest.skip(f"{PYTHONS[peer][1]} names no interpreter")
    return python


def test_pysindy_finds_a_term_and_keeps_quiet_in_noise(tmp_path: Path) -> None:
    python = _python("pysindy")
    save_given(tmp_path / "term.npz", _given(20.0))
    found = run_peer("sindy_peer", python, str(tmp_path / "term.npz"), package=PACKAGE)
    assert (found["where"], found["adequate"]) == (["constitutive"], False), found
    assert found["held_out_error"] < 1.2
    save_given(tmp_path / "noise.npz", _given(0.0))
    assert run_peer("sindy_peer", python, str(tmp_path / "noise.npz"), "--sparse", package=PACKAGE)["adequate"]


def test_jax_sysid_identifies_a_lag(tmp_path: Path) -> None:
    python, runs = _python("jax_sysid"), []
    for k in range(6):
        random, shown = np.random.default_rng(k), np.zeros(151)
        command = np.repeat(random.uniform(-1.0, 1.0, 16), 10)[:151]
        for i in range(150):
            shown[i + 1] = 0.9 * shown[i] + 10.0 * command[i]
        reading = shown + random.normal(0.0, 1.0, 151)
        runs.append(Series(f"run {k}", k < 4, {"voltage": command}, reading, np.zeros(151), {}))
    save_given(tmp_path / "lag.npz", Given("arm", 0.1, tuple(runs)))
    found = run_peer("sysid_peer", python, str(tmp_path / "lag.npz"), "--linear", package=PACKAGE)
    assert found["held_out_error"] < 1.2, found


def test_a_peer_without_its_environment_says_which_is_missing(
    bench: Bench, base: Answer, monkeypatch: pytest.MonkeyPatch
) -> None:
    for peer, (_, variable, _) in PYTHONS.items():
        monkeypatch.delenv(variable, raising=False)
        assert variable in told_by(peer, bench, base).reason


def test_a_case_is_asked_once_and_no_answer_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peers_run, "opened", lambda folder: None)
    monkeypatch.setattr(peers_run, "refitted", lambda bench, case: dataclasses.replace(PLAIN, case=case))
    told = [Answer("greedy", "one", reason="no"), Answer("greedy", "one", held_out_error=2.0)]
    monkeypatch.setitem(peers_run.PEERS, "greedy", lambda bench, base: told.pop(0))
    kept = tmp_path / "peers" / "greedy" / "one.json"
    assert peers_run.asked("greedy", "one", tmp_path).reason == "no"
    assert not kept.exists()
    assert peers_run.asked("greedy", "one", tmp_path).held_out_error == 2.0
    assert load(kept).held_out_error == 2.0
    assert load(tmp_path / "peers" / "plain" / "one.json").case == "one"


def _row(method: str, *some: Judged) -> dict[str, str]:
    return dict(zip(HEAD, line(method, some), strict=True))


def test_the_table_says_nothing_for_a_peer_that_does_not(tmp_path: Path) -> None:
    heat, null = _truth(latent_heat="heat"), _truth("null")
    greedy = judged(heat, Answer("greedy", "c", ("creep",), ("constitutive",), False, 1.0, 2.0, 3.0), PLAIN)
    alarm = judged(null, Answer("greedy", "c", ("creep",), ("constitutive",), False, 1.0, 1.0, 3.0), PLAIN)
    row = _row("greedy", greedy, alarm)
    assert row["right effect added"] == "0 of 1 (0 %)"
    assert row["false alarms"] == "1 of 1 (100 %)"
    assert row["needless effects a case"] == "1.0"
    assert row["held-out error, median"] == "2.00"
    plain = _row("plain", judged(heat, PLAIN, PLAIN), judged(null, PLAIN, PLAIN))
    assert {plain[name] for name in ("right effect added", "right equation first", "false alarms")} == {"–"}
    assert plain["held-out error, median"] == "8.00"


def test_all_are_compared_on_cases_that_all_have_answered(tmp_path: Path) -> None:
    truth = _truth(latent_heat="heat")
    loop = judged(truth, Answer("smajax", "c", ("latent_heat",), ("heat",), False, 1.0, 2.0, 5.0), PLAIN)
    better = Answer("greedy", "c", ("creep",), ("constitutive",), False, 1.0, 1.5, 9.0)
    for folder in ("judged", "cases/truth"):
        (tmp_path / folder).mkdir(parents=True)
    from smajax.core.files import json_text, replace

    for case in ("one", "two"):
        save(dataclasses.replace(loop, case=case), tmp_path / "judged" / f"{case}.json")
        replace(tmp_path / "cases" / "truth" / f"{case}.json", json_text({**truth, "case": case}))
        save_answer(PLAIN, tmp_path / "peers" / "plain" / f"{case}.json")
    save_answer(better, tmp_path / "peers" / "greedy" / "one.json")
    methods = gathered(tmp_path)
    assert {name: len(one) for name, one in methods.items() if one} == {"smajax": 2, "plain": 2, "greedy": 1}
    assert "greedy on 1 (one)" in beaten(methods, ["greedy"], ["one"])
    found = text(methods)
    assert "smajax, greedy, plain on 1 cases (1 single; rig):" in found
    assert "| two | 10.0 | latent_heat 2.00 |  | 8.00 |" in found
