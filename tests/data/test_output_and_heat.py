"""Outputs against the heat of their run: what hardly follows it, or moves against it, belongs to another log or has another sign."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from tests.helpers.small_bench import bench, table


def _warned(experiment: Path, words: str) -> bool:
    return any(words in one for one in load_experiment(experiment, CATALOGUE).warnings)


@pytest.mark.parametrize("shuffled", [True, False])
def test_an_output_that_does_not_follow_the_heat_is_a_warning(tmp_path: Path, shuffled: bool) -> None:
    """Samples in an order of chance, and the log of a sensor that was at another bench."""
    experiment = bench(tmp_path)
    for number, name in enumerate(("a.csv", "b.csv")):
        held = np.loadtxt(tmp_path / name, delimiter=",", skiprows=1)
        t, x = held[:, 0], held[:, 2]
        other = np.random.default_rng(number).permutation(x) if shuffled else 9.0 * np.sin(2.0 * np.pi * t) ** 2
        table(tmp_path / name, t, held[:, 1], other)
    assert _warned(experiment, "the output 'position' hardly follows the heat (rank correlation 0.")
    assert not _warned(bench(tmp_path), "hardly follows")


def _slow(folder: Path, seconds: float, tau: float = 25.0) -> Path:
    """Two logs of pulses, with an output that goes with many of them."""
    experiment = bench(folder)
    t = np.arange(0.0, seconds, 0.05)
    for number, name in enumerate(("a.csv", "b.csv")):
        share = 0.5 + 0.4 * np.sin(2.0 * np.pi * t / (12.0 + 5.0 * number) + number)
        u = 5.0 * (t % 2.0 / 2.0 < share)
        x = np.zeros_like(t)
        for k in range(1, t.size):
            x[k] = x[k - 1] + 0.05 / tau * (18.0 * (u[k - 1] / 5.0) ** 2 - x[k - 1])
        table(folder / name, t, u, x + np.random.default_rng(number).normal(0.0, 0.05, t.size))
    return experiment


def test_an_output_that_follows_as_slowly_as_a_thicker_wire_is_no_warning(tmp_path: Path) -> None:
    """Of a draft without a wire the preset may be a tenth as thick: its temperature comes and goes with each pulse, that of the bench with many."""
    assert not _warned(_slow(tmp_path, 150.0), "hardly follows")


def test_outputs_of_each_other_s_inputs_are_a_warning(tmp_path: Path) -> None:
    """Two logs of quick pulses at moments of chance, with their outputs exchanged."""
    experiment = bench(tmp_path)
    t = np.arange(0.0, 40.0, 0.05)
    logs = []
    for number in range(2):
        edges = np.cumsum(np.random.default_rng(number).uniform(0.7, 3.0, 60))
        u = 5.0 * (np.searchsorted(edges, t) % 2)
        x = np.zeros_like(t)
        for k in range(1, t.size):
            x[k] = x[k - 1] + 0.05 / 0.8 * (18.0 * (u[k - 1] / 5.0) ** 2 - x[k - 1])
        logs.append((u, x))
    for name, (u, _), (_, x) in zip(("a.csv", "b.csv"), logs, logs[::-1], strict=True):
        table(tmp_path / name, t, u, x)
    assert _warned(experiment, "hardly follows")
    for name, (u, x) in zip(("a.csv", "b.csv"), logs, strict=True):
        table(tmp_path / name, t, u, x)
    assert not _warned(experiment, "hardly follows")


def test_a_sensor_that_was_turned_round_in_one_run_is_a_warning_with_the_run(tmp_path: Path) -> None:
    def three_runs(folder: Path, *, mended: bool = False) -> Path:
        path = bench(folder)
        third = '[[runs]]\nname = "C"\nrole = "fit"\nfile = "c.csv"\n' + 'reversed = ["position"]\n' * mended
        path.write_text(path.read_text() + third)
        held = np.loadtxt(folder / "a.csv", delimiter=",", skiprows=1)
        table(folder / "c.csv", held[:, 0], held[:, 1], 21.0 - held[:, 2])
        return path

    words = "run 'C': the output 'position' moves against the model (rank correlation with the heat -0."
    assert _warned(three_runs(tmp_path), words)
    assert _warned(three_runs(tmp_path), "Set reversed = ['position'] in that run")
    mended = three_runs(tmp_path, mended=True)
    assert not _warned(mended, "moves against the model")
    first, _, third = load_experiment(mended, CATALOGUE).runs
    assert third.outputs["position"] == pytest.approx(first.outputs["position"] - 0.021, abs=1e-7)
    mended.write_text(mended.read_text().replace('reversed = ["position"]', 'reversed = ["voltage"]'))
    with pytest.raises(ExperimentError, match=r"runs.C.reversed"):
        load_experiment(mended, CATALOGUE)
