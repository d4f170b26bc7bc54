"""What is probably a mistake in an experiment is a warning."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from smajax.data.experiment.catalogue import ModelDescription
from smajax.data.experiment.load import load_experiment
from tests.helpers.bench_experiment import BENCH, CATALOGUE, ONE_FIT, changed, describe, load, rewrite, write_run


def test_a_unit_that_the_heading_contradicts_is_a_warning(bench: Path) -> None:
    for name in ("a.csv", "b.csv"):
        (bench / name).write_text((bench / name).read_text().replace("time,duty,pos", "time [ms],duty [%],pos_m", 1))
    changed(
        changed(changed(bench, '"pos"', '"pos_m"'), '"time"', '"time [ms]"'), 'column = "duty"', 'column = "duty [%]"'
    )
    told = [text for text in load(bench).warnings if "heading" in text]
    assert told == [
        "channels.position.unit is 'mm', and the heading 'pos_m' says m: 1 m is 1000 mm. One of the two is wrong; the file's is taken"
    ]


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        ("position_degC", "degC"),
        ("temp [degC]", "degC"),
        ("T [C]", "C"),
        ("force in N", "N"),
        ("pos_s", ""),
        ("x [ch1]", ""),
    ],
)
def test_a_heading_with_a_unit_of_another_kind_is_asked_about(bench: Path, heading: str, said: str) -> None:
    for name in ("a.csv", "b.csv"):
        (bench / name).write_text((bench / name).read_text().replace("time,duty,pos", f"time,duty,{heading}", 1))
    told = [text for text in load(changed(bench, '"pos"', f'"{heading}"')).warnings if "heading" in text]
    assert told == [
        f"channels.position.unit is 'mm', and the heading {heading!r} says {said}, a unit of another kind: is that the column? Its numbers are taken as "
        "the file says"
    ] * bool(said)


def test_an_uneven_clock_is_a_warning(bench: Path) -> None:
    lines = (bench / "a.csv").read_text().splitlines()
    kept = [line for number, line in enumerate(lines) if number % 5 != 2 or number == 0]
    (bench / "a.csv").write_text("\n".join(kept) + "\n")
    assert any("'position' is sampled unevenly (0.01 to 0.02 s apart)" in told for told in load(bench).warnings)


def test_an_implausible_channel_is_a_warning(bench: Path) -> None:
    swing = 10.0 * np.sin(np.arange(500) / 20.0)
    cases: list[tuple[str, dict[str, object]]] = [
        ("outside 0 to 1; is it in percent", {"duty": 2000.0}),
        ("the output 'position' is constant", {"position": np.zeros(500)}),
        ("runs into its highest value and stays exactly there", {"position": np.minimum(swing, 7.0)}),
        ("runs into its lowest value and stays exactly there", {"position": np.maximum(swing, -7.0)}),
        ("increment of 0.5 mm is larger than its noise of 0.01 mm", {"position": 0.5 * np.round(swing / 0.5)}),
        ("only 10 samples", {"count": 50}),
    ]
    for words, change in cases:
        rewrite(bench / "a.csv", **change)  # type: ignore[arg-type]
        assert any(words in one for one in load(bench).warnings), (words, load(bench).warnings)
    rewrite(bench / "a.csv")
    assert load(bench).warnings == (ONE_FIT,)
    assert any("shorter than the sensor's" in one for one in load(changed(bench, '"50 ms"', '"2 ms"')).warnings)


def test_a_gap_in_time_is_a_warning(bench: Path) -> None:
    lines = (bench / "a.csv").read_text().splitlines()
    (bench / "a.csv").write_text("\n".join(lines[:200] + lines[300:]) + "\n")
    assert any("'position' has a gap of 1.01 s" in one for one in load(bench).warnings)


def test_few_runs_and_none_held_out_are_warnings(bench: Path) -> None:
    warnings = load(changed(bench, 'role = "held-out"', 'role = "fit"')).warnings
    assert any(one.startswith("only 2 fit runs: ") for one in warnings)
    assert "no run is held out: the error after is shown on no run that the fit never saw" in warnings


def test_a_run_in_which_hardly_anything_moves_is_a_warning(bench: Path) -> None:
    """Held out, below a tenth of what the fit runs do; fitted, hardly more than the noise. The runs of the bench move by 8 mm."""

    def said() -> list[str]:
        return [text for text in load(bench).warnings if "changes by" in text]

    ramp, noise = np.linspace(0.0, 1.0, 500), 0.01 * np.random.default_rng(7).normal(size=500)
    assert said() == []
    rewrite(bench / "b.csv", position=noise + 0.9 * ramp)
    assert said() == []
    rewrite(bench / "b.csv", position=noise + 0.6 * ramp)
    (sentence,) = said()
    assert sentence.startswith("run 'B' is held out, and its output 'position' changes by 0.58")
    assert "% of what it changes by in the fit runs" in sentence
    rewrite(bench / "b.csv", position=noise)
    assert any("times its noise: an error on it says little" in text for text in said())
    rewrite(bench / "b.csv")
    rewrite(bench / "a.csv", position=noise)
    (sentence,) = said()
    assert sentence.startswith("run 'A': the output 'position' changes by 0.0")
    assert "so the fit learns little from it" in sentence


def test_a_run_of_hours_is_a_warning(bench: Path) -> None:
    changed(bench, '"50 ms"', '"50 s"')
    assert "run 'B' lasts 7150 s; is the time in ms?" not in load(changed(bench, 'unit = "ms"', 'unit = "s"')).warnings
    write_run(bench / "a.csv", count=2001)
    assert "run 'A' lasts 20000 s; is the time in ms?" in load(bench).warnings
    changed(changed(bench, 'unit = "s"', 'unit = "min"'), '"50 s"', '"10 min"')
    assert "run 'A' lasts 1.2e+06 s; is the time in min, as [time] says?" in load(bench).warnings


@pytest.mark.parametrize(
    ("drive", "unit", "words"),
    [("voltage", "V", "the voltage reaches 4200 V; is it in mV?"), ("current", "A", "the current reaches 4200 A; is")],
)
def test_numbers_too_large_for_a_wire_are_a_warning(bench: Path, drive: str, unit: str, words: str) -> None:
    def driven(wire: str, load: str, drive: str, law: str = "") -> ModelDescription:
        return replace(describe(wire, load, drive), inputs_required=frozenset({drive}))

    catalogue = replace(CATALOGUE, drives={drive}, describe=driven)
    text = BENCH.replace('drive = "duty"', f'drive = "{drive}"').replace("[channels.duty]", f"[channels.{drive}]")
    (bench / "experiment.toml").write_text(text.replace('unit = "%"', f'unit = "{unit}"'))
    rewrite(bench / "a.csv", duty=4200.0)
    assert sum(words in one for one in load_experiment(bench, catalogue).warnings) == 1
    (bench / "experiment.toml").write_text(text.replace('unit = "%"', f'unit = "m{unit}"'))
    assert load_experiment(bench, catalogue).warnings == (ONE_FIT,)
