"""What pictures of a report are drawn from."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from smajax.report import pictures
from tests.helpers.made_findings import NAN, made_effect


def test_candidates_are_ranked_as_the_page_explains(findings):
    late = [
        dataclasses.replace(made_effect(name, name, "heat", NAN), evidence={"posterior_probability": probability})
        for name, probability in (("b", 0.0), ("c", 0.001), ("d", 0.01))
    ]
    order = [effect.name for effect in pictures.ranked((findings.effects[2], *late, *findings.effects[:2]))]
    assert order == ["latent_heat", "radiation", "d", "c", "b", "sensor_lag"]


def test_a_run_without_a_temperature_has_no_hysteresis_picture(findings):
    assert pictures.run_hysteresis(findings, dataclasses.replace(findings.runs[0], states={})) is None


def test_long_runs_keep_their_peaks(findings):
    time = np.linspace(0.0, 1.0, 100_003)
    values = np.zeros_like(time)
    values[77_777], values[100_002] = 5.0, -3.0
    thin_time, thin_values = pictures.extremes(time, values)
    assert len(thin_time) < 2 * pictures.SAMPLES_DRAWN
    assert (thin_values.max(), thin_values.min()) == (5.0, -3.0)
    assert thin_time[thin_values.argmax()] == time[77_777]
    assert np.all(np.diff(thin_time) >= 0.0)


def test_autocorrelation_of_white_noise_and_of_a_sine():
    rng = np.random.default_rng(0)
    white = pictures.autocorrelation([rng.normal(size=20_000), rng.normal(size=10_000)], 50)
    assert white[0] == 1.0
    assert np.abs(white[1:]).max() < 4.0 / np.sqrt(30_000)
    sine = pictures.autocorrelation([np.sin(2.0 * np.pi * np.arange(10_000) / 100.0)], 100)
    assert sine[50] == pytest.approx(-1.0, abs=0.01)
    assert sine[100] == pytest.approx(1.0, abs=0.011)
