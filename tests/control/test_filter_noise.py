"""The noise that a filter expects of a reading: that of its loop, unless it is one of the caller's own."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import smajax as sma
from smajax.control.closed_loop import ClosedLoopSetup
from smajax.control.compose import with_values
from smajax.control.estimators.adaptive_filter import AdaptiveFilter
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.estimators.model_filter import ModelFilter
from smajax.control.estimators.printed_filter import PrintedFilter
from smajax.control.loop_around import loop_around
from smajax.control.loop_dataset import Loop, simulate_loop_dataset
from smajax.control.presets import FILTERS, filter_of
from smajax.control.run_request import LoopRequest, RunRequest, run_closed
from smajax.control.signal_path import interface_of
from smajax.core.parameters import set_parameters
from smajax.model.presets import build

ARM = build("niti_table_3_1", "arm", "amplified_voltage")
HANGING = build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
NOISE = np.radians(0.5)


def expected_noise(estimator: AbstractEstimator | None) -> float:
    """Standard deviation of a reading, rad or m."""
    own = estimator.filter if isinstance(estimator, AdaptiveFilter) else estimator
    assert isinstance(own, ModelFilter)
    return float(own.reading_noise)


@pytest.mark.parametrize("name", ["model", "adaptive"])
def test_a_filter_expects_the_noise_of_its_loop(name: str) -> None:
    """It was that of the preset, 0.06 deg, in a loop with eight times as much, and followed the noise."""
    assert expected_noise(loop_around(ARM, "sld", estimator=name, noise="0.5 deg").estimator) == pytest.approx(NOISE)
    assert expected_noise(loop_around(HANGING, "pid", estimator=name, noise="30 um").estimator) == pytest.approx(3e-5)
    assert expected_noise(interface_of(ARM, name, 0.5, 0.01, 0.01, 0).estimator) == pytest.approx(NOISE)
    preset = expected_noise(FILTERS[name](ARM))
    assert expected_noise(loop_around(ARM, "sld", estimator=name).estimator) == preset
    assert expected_noise(loop_around(ARM, "sld", estimator=name, quantum="1 deg").estimator) == preset


def test_a_filter_of_one_s_own_keeps_its_noise() -> None:
    own = set_parameters(FILTERS["model"](ARM), {"reading_noise": 2e-3})
    assert expected_noise(loop_around(ARM, "sld", estimator=own, noise="0.5 deg").estimator) == 2e-3


def test_the_source_s_filter_keeps_its_r() -> None:
    printed = filter_of("printed", ARM, NOISE)
    assert isinstance(printed, PrintedFilter)
    assert float(printed.reading_variance) == 1e-2


def test_a_loop_is_quieter_with_a_filter_that_knows_its_noise() -> None:
    loop = loop_around(ARM, "sld", estimator="model", noise="0.5 deg")

    def off(one: Loop) -> float:
        """Degrees, root mean square, from 3 s after each set point to the next one."""
        squares = []
        for seed in range(3):
            run = simulate_loop_dataset(one, "40deg:5s,10deg:5s", seed=seed)
            since = run["time"].to_numpy() % 5.0
            settled = (since > 3.0) & (since < 4.9)
            squares.append(np.mean((run["position"] - run["wanted"]).to_numpy()[settled] ** 2))
        return float(np.degrees(np.sqrt(np.mean(squares))))

    quiet, before = off(loop), off(dataclasses.replace(loop, estimator=FILTERS["model"](ARM)))
    assert quiet < 0.1
    assert quiet < 0.3 * before


def test_a_request_by_names_puts_its_noise_into_the_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[AbstractEstimator | None] = []

    def noted(setup: ClosedLoopSetup, tolerance: object) -> None:
        seen.append(setup.estimator)
        raise ValueError("seen")

    monkeypatch.setattr("smajax.control.run_request.measured_loop", noted)
    with pytest.raises(ValueError, match="seen"):
        run_closed(RunRequest(), LoopRequest("sld", "40deg:1s", estimator="model", noise="0.5deg"))
    assert expected_noise(seen[0]) == pytest.approx(NOISE)


def test_a_value_of_the_filter_among_those_of_the_model_is_told_where_it_is_set() -> None:
    with pytest.raises(ValueError, match=r"it is one of the filters `model` and `adaptive`.*--noise"):
        with_values(ARM, {"reading_noise": "0.5 deg"})
    with pytest.raises(ValueError, match=r"It is set in Python: `loop_around"):
        with_values(ARM, {"temperature_walk": 1.0})
    with pytest.raises(ValueError, match="`smajax presets WIRE LOAD DRIVE` lists"):
        with_values(sma.build("flexinol_isobaric", "coupon", "none"), {"reading_noise": 1.0})
