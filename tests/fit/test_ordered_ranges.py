"""Transformation ranges that a fit would end with reversed: put in order where that is possible, and said where it is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tests.fit.test_identify as coupon
from smajax.core.parameters import parameter_values
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.model_file.read import load_model
from smajax.fit.experiment_problem import declared_problem
from smajax.fit.levenberg_marquardt import Fit, FitSettings, levenberg_marquardt
from smajax.fit.ordered_ranges import in_order
from smajax.fit.problem import FitTask, Problem
from smajax.model.presets import build
from smajax.report.range_words import range_sentences
from tests.helpers.small_bench import smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")


def reversed_fit(experiment: Experiment, heating: tuple[float, float] = (79.0, 62.0)) -> tuple[Problem, FitTask, Fit]:
    """The fit from a start whose range on heating is reversed, or of next to no width, which nothing in the descent changes."""
    problem = declared_problem(experiment, [run for run in experiment.runs if run.role == "fit"])
    bounds = {one.name: (one.low, one.high) for one in experiment.unknowns}
    values = problem.start_values()
    values[[problem.names.index(name) for name in ("austenite_start", "austenite_finish")]] = heating
    task = problem.task(tuple(bounds), bounds, values)
    return problem, task, levenberg_marquardt(problem, [task])[0]


def overlapping(folder: Path) -> Experiment:
    file = coupon.coupon_file(folder, coupon.NOISE)
    file.write_text(file.read_text().replace('low = "79.5 degC"', 'low = "60 degC"'))
    return load_experiment(file, CATALOGUE)


def values_of(problem: Problem, fit: Fit) -> dict[str, float]:
    return dict(zip(problem.names, fit.values.tolist(), strict=True))


@pytest.mark.parametrize("heating", [(79.0, 62.0), (79.0, 79.02)])
def test_a_fit_that_ends_reversed_or_without_a_width_is_put_in_order(
    heating: tuple[float, float], tmp_path: Path
) -> None:
    problem, task, plain = reversed_fit(overlapping(tmp_path), heating)
    before = values_of(problem, plain)
    assert before["austenite_finish"] - before["austenite_start"] < 0.05
    (found,) = in_order(problem, [task], [plain])
    after = values_of(problem, found)
    assert found.cost < 0.1 * plain.cost
    for name, true in coupon.TRUTH.items():
        assert after[name] == pytest.approx(true, rel=0.02)
    assert in_order(problem, [task], [found]) == [found]


def test_a_reversed_fit_that_is_the_better_one_becomes_the_narrowest_range(tmp_path: Path) -> None:
    """Without the steps that the fit in order needs: the same model as the reversed one, with its ends in order, and it says so."""
    problem, task, plain = reversed_fit(overlapping(tmp_path))
    (found,) = in_order(problem, [task], [plain], FitSettings(max_steps=0))
    after = values_of(problem, found)
    assert 0.0 < after["austenite_finish"] - after["austenite_start"] < 0.05
    assert found.cost == pytest.approx(plain.cost, rel=1e-9)
    (sentence,) = range_sentences(after)
    assert "austenite_start and austenite_finish end together" in sentence
    assert "heats until the transformation has ended" in sentence


def test_what_the_bounds_hold_reversed_is_said(tmp_path: Path) -> None:
    """A finish that is given below the true start: no order fits, and terminal, page and the model file say so."""
    file = coupon.coupon_file(tmp_path, coupon.NOISE)
    lines = [line for line in file.read_text().splitlines() if not line.startswith("austenite_finish")]
    text = "\n".join(lines).replace('high = "79 degC"', 'high = "90 degC"')
    file.write_text(text.replace("[unknown]", '[model.parameters]\naustenite_finish = "69 degC"\n[unknown]'))
    said = smajax("identify", file, "--starts", "0", "--out", tmp_path / "out").out
    assert "the range on heating is reversed: austenite_start is" in said
    assert "A_s &lt; A_f" in (tmp_path / "out" / "identify.html").read_text(encoding="utf-8")
    with pytest.raises(ExperimentError, match="is not below"):
        load_model(tmp_path / "out" / "model.toml")


def test_a_range_in_order_needs_no_word() -> None:
    system = build("flexinol_table_3_2", "coupon", "none")
    values = {name: float(value) for name, value in parameter_values(system).items()}
    assert range_sentences(values) == []
    (cold,) = range_sentences({**values, "martensite_start": values["martensite_finish"] - 1.0})
    assert "the range on cooling is reversed" in cold
    assert "M_f < M_s" in cold


def test_ends_that_were_exchanged_stay_within_their_bounds(tmp_path: Path) -> None:
    problem, task, plain = reversed_fit(overlapping(tmp_path))
    (found,) = in_order(problem, [task._replace(high=np.minimum(task.high, 80.0))], [plain])
    assert values_of(problem, found)["austenite_finish"] == pytest.approx(80.0)
