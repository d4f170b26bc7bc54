"""The study of what a found model is worth in control: its benches are benches, and its summary counts what it says."""

from __future__ import annotations

from pathlib import Path
from statistics import fmean
from typing import Any

import pytest

from smajax.data.open_experiment import open_experiment
from studies.model_in_control.run import EFFECTS, bench_truth, gain, summary, write_bench


@pytest.mark.parametrize("number", range(len(EFFECTS)))
def test_a_bench_has_one_hidden_effect_within_what_a_bench_may_have(number: int) -> None:
    truth, effect = bench_truth(number)
    assert truth.effects == (effect,)
    for coefficient, (low, high) in EFFECTS[effect].items():
        assert low <= truth.values[f"{effect}.{coefficient}"] <= high
    values = truth.values
    assert values["martensite_finish"] < values["martensite_start"] < values["austenite_finish"]
    assert bench_truth(number)[0].values == values


def test_its_experiment_gives_what_is_known_and_not_what_is_hidden(tmp_path: Path) -> None:
    path, truth, effect = write_bench(3, tmp_path)
    experiment = open_experiment(path)
    assert {run.role for run in experiment.runs} == {"fit", "held-out"}
    assert experiment.parameters["load_mass"] == truth.values["load_mass"]
    assert not any(effect in name for name in experiment.parameters)
    # The wire moves: a bench that tells nothing is none.
    assert max(float(run.output.max()) for run in experiment.runs) > 5e-3


def test_the_summary_counts_what_is_better_equal_and_no_answer() -> None:
    def figures(base: float | None, extended: float | None, other: float | None = 4.0) -> dict[str, Any]:
        models = (("base model", base), ("extended model", extended))
        return {
            "seconds": 20.0,
            **{name: {"settling_time": [time, other], "gains": {"integral_gain": time}} for name, time in models},
        }

    assert gain(figures(6.0, 4.0)) == pytest.approx(1.5)
    assert gain(figures(6.0, 4.0), fmean) == pytest.approx(1.25)
    assert gain(figures(None, 4.0)) == pytest.approx(5.0)  # null: never settles, counts as the loop's length
    one = {"hidden": "creep", "found": ["creep"], "verdict": "explained"}
    pairs = [(6.0, 4.0), (4.0, 4.0), (4.0, 6.0), (None, 4.0), (5.0, 5.05)]
    results: list[dict[str, Any]] = [{"bench": k, **one, "pid": figures(*pair)} for k, pair in enumerate(pairs)]
    results.append({"bench": 5, **one, "pid": figures(None, None, None)})
    results.append({"bench": 6, **one, "found": []})
    text = summary(results)
    assert "| pid | longest | 5 | 1 | 1 | 3 | 4 | 2 | 1.000 | 0.667 | 5.000 |" in text
    assert "7 benches, of which on 1 nothing was found and nothing tuned." in text
    assert "| 2 | creep | creep | explained | 0.667 | – |" in text
