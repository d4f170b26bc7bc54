"""Outputs whose readings cannot be what the experiment file declares them to be are asked about; what can be is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.data.open_experiment import open_experiment
from tests.helpers.small_bench import bench

COLD, HOT = 23.0, 95.0  # degC, of the wire in these logs


def _warnings(folder: Path, quantity: str, unit: str, cold: float, hot: float, *more: tuple[str, str]) -> list[str]:
    """Of a bench whose logs have one more column, between `cold` and `hot`, declared as `quantity` in `unit`."""
    channel = f'[channels.{quantity}]\nrole = "output"\ncolumn = "extra"\nunit = "{unit}"\n[[runs]]\nname = "A"'
    path = bench(folder, ('[[runs]]\nname = "A"', channel), *more)
    for name, seed in (("a.csv", 0), ("b.csv", 1)):
        log = folder / name
        columns = np.loadtxt(log, delimiter=",", skiprows=1)
        follows = columns[:, 2] / 18.0
        noise = 2e-3 * abs(hot - cold) * np.random.default_rng(seed).normal(size=follows.size)
        extra = cold + (hot - cold) * follows + noise
        np.savetxt(log, np.column_stack([columns, extra]), delimiter=",", header="t,U,x,extra", comments="", fmt="%.6g")
    return [text for text in open_experiment(path).warnings if f"output {quantity!r}" in text]


def test_a_temperature_of_the_wire_raises_no_question(tmp_path: Path) -> None:
    assert _warnings(tmp_path, "temperature", "degC", COLD, HOT) == []


@pytest.mark.parametrize(
    ("cold", "hot", "words"),
    [
        (3.1, 2.8, "never colder than the air"),
        (131.0, 118.0, "is not heated has the temperature of the air"),
        (24.2, 25.0, "changes by 0.8"),
    ],
)
def test_a_resistance_declared_as_a_temperature_is_a_warning(
    tmp_path: Path, cold: float, hot: float, words: str
) -> None:
    told = [text for text in _warnings(tmp_path, "temperature", "degC", cold, hot) if words in text]
    assert len(told) == 1
    assert "Is it the right column" in told[0]


def test_a_run_that_is_said_to_begin_warm_may_be_warm_throughout(tmp_path: Path) -> None:
    run = ('file = "b.csv"', 'file = "b.csv"\n[runs.parameters]\ninitial_temperature = "80 degC"')
    told = _warnings(
        tmp_path,
        "temperature",
        "degC",
        60.0,
        HOT,
        run,
        ('file = "a.csv"', 'file = "a.csv"\nparameters = { initial_temperature = "80 degC" }'),
    )
    assert told == []


@pytest.mark.parametrize(("cold", "hot", "asked"), [(10.0, 9.0, False), (400.0, 380.0, True), (0.010, 0.009, True)])
def test_a_resistance_that_no_wire_of_that_size_has_is_a_warning(
    tmp_path: Path, cold: float, hot: float, asked: bool
) -> None:
    told = [text for text in _warnings(tmp_path, "resistance", "ohm", cold, hot) if "length, diameter" in text]
    assert len(told) == asked


def test_a_position_beyond_the_wire_is_a_warning_where_its_zero_is_not_fitted(tmp_path: Path) -> None:
    path = bench(tmp_path)
    for name in ("a.csv", "b.csv"):
        columns = np.loadtxt(tmp_path / name, delimiter=",", skiprows=1)
        columns[:, 2] += 2500.0
        np.savetxt(tmp_path / name, columns, delimiter=",", header="t,U,x", comments="", fmt="%.6g")
    words = "more than the wire's length"
    assert sum(words in text for text in open_experiment(path).warnings) == 1
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('unit = "mm"', 'unit = "mm"\noffset = true'), encoding="utf-8")
    assert not any(words in text for text in open_experiment(path).warnings)
