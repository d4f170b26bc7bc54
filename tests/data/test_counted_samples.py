"""Logs without a time: samples are counted, and the experiment file may say how far apart they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.data.experiment.draft import draft
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE

SPRING = """
[model]
wire = "flexinol_ht_500um"
load = "bias_spring"
drive = "voltage"
[time]
kind = "sample"
{sampling}
[channels.voltage]
role = "input"
column = "voltage_V"
unit = "V"
[channels.position]
role = "output"
column = "position_mm"
unit = "mm"
noise = "0.01 mm"
[[runs]]
name = "a"
role = "fit"
file = "a.csv"
"""


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    volts = np.repeat([0.0, 6.0, 0.0], 40)
    rows = np.stack([volts, np.cumsum(volts) / 100.0], axis=1)
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="voltage_V,position_mm", comments="")
    return tmp_path / "experiment.toml"


def test_samples_are_as_far_apart_as_the_file_says(bench: Path) -> None:
    bench.write_text(SPRING.format(sampling='[sampling]\nstep = "50 ms"'))
    found = load_experiment(bench, CATALOGUE)
    np.testing.assert_allclose(found.runs[0].time, 0.05 * np.arange(120), atol=1e-12)
    assert (found.step, found.clocked) == (0.05, True)
    # Each sample is as logged, and none lies between two.
    np.testing.assert_allclose(found.runs[0].inputs["voltage"], np.repeat([0.0, 6.0, 0.0], 40), rtol=1e-12)
    np.testing.assert_allclose(found.runs[0].outputs["position"][40:42], [6e-5, 12e-5], rtol=1e-12)


def test_a_heated_wire_needs_the_time_between_samples(bench: Path) -> None:
    """It was taken for a second, without a word, and everything that was fitted was wrong."""
    bench.write_text(SPRING.format(sampling=""))
    with pytest.raises(ExperimentError, match=r"sampling: is missing; .* step = '50 ms' or so, the time from one"):
        load_experiment(bench, CATALOGUE)


def test_a_draft_asks_for_the_time_between_samples(bench: Path) -> None:
    drafted = draft([bench.parent / "a.csv"], bench)
    assert "time: none found, samples are counted" in drafted.messages[0]
    assert "write the time from one sample to the next as step under [sampling]" in drafted.messages[0]
    asked = (
        '# [sampling]\n# step = "50 ms"  # the time from one sample to the next: of a heated wire it has to be given'
    )
    assert asked in drafted.text
    bench.write_text(drafted.text.replace("# [sampling]\n# step", "[sampling]\nstep"))
    assert load_experiment(bench, CATALOGUE).step == 0.05
