"""A gradient beside others: the problem's exact slopes, ours on it, and the page that tells of it."""

from __future__ import annotations

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.simulation.simulate import DEFAULT_STEP
from studies.benchmarks import gradient, problem, tracking
from studies.benchmarks.table import told

MACHINE = {"processor": "one", "cores": 2, "system": "s", "python": "3", "compiler": "c", "versions": {"smajax": "0"}}
SPENT = {"cost_s": 0.1, "gradient_s": 0.4, "gradient_over_cost": 4.0, "gradient_memory_MB": 5.0}
WAY = {**SPENT, "setting": 1e-4, "gradient_error": 0.01, "gradient_compile_s": 2.0}
FORWARD = {"jacobian_s": 1.0, "jacobian_over_cost": 10.0, "jacobian_memory_MB": 1.0, "jacobian_compile_s": 3.0}
OURS = {**WAY, "members": 100, "xla": {**SPENT, "gradient_s": 0.6, "gradient_compile_s": 9.0, **FORWARD}}


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> tracking.Tracking:
    folder = tmp_path_factory.mktemp("tracking")
    file, made = tracking.tracking(problem.constants(), 3, 5, folder)
    kept = tracking.load(file)
    assert kept.error(made.slopes) == 0.0
    np.testing.assert_array_equal(kept.solved, made.voltage[[0, 2, 4]])
    return made


def test_the_benchmark_of_smajax_is_the_same_problem(given: tracking.Tracking) -> None:
    # One slope of each member, by all parameters together: a gradient takes ten times as long to compile.
    cost = gradient.cost_of(gradient.tracked_arm(given), given.names, round(tracking.SECONDS / DEFAULT_STEP))
    at = jnp.asarray(given.vector)
    ahead = jnp.where(np.array(given.names) == tracking.UNKNOWN, 0.0, at)

    def along(volts: jax.Array) -> tuple[jax.Array, jax.Array]:
        return jax.jvp(lambda vector: cost(vector, volts), (at,), (ahead,))

    ours, slope = jax.jit(jax.vmap(along))(jnp.asarray(given.solved))
    np.testing.assert_allclose(ours, given.cost, rtol=1e-3)
    norm = np.linalg.norm(given.slopes * np.asarray(ahead), axis=1)
    assert (np.abs(slope - given.slopes @ np.asarray(ahead)) < tracking.LIMIT * norm).all()


def test_an_error_of_one_slope_is_detected(given: tracking.Tracking) -> None:
    for name in ("amplifier_gain", tracking.UNKNOWN):
        off = given.slopes.copy()
        off[1, given.names.index(name)] *= 1.1
        off[1, given.names.index(name)] += 1.0
        assert (given.error(off) > tracking.LIMIT) == (name != tracking.UNKNOWN)
    assert given.error(np.full_like(given.slopes, np.nan)) == float("inf")


def test_slopes_do_not_depend_on_the_steps_of_differences(
    given: tracking.Tracking, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tracking, "DIFFERENCE", 3e-5)
    _, slopes = tracking._solved(given.constants, given.solved)
    assert given.error(slopes) < 1e-2 * tracking.LIMIT


def test_the_page_lists_every_way(tmp_path: Path) -> None:
    by = {
        "members": 100,
        "ways": [
            {**WAY, "way": "gradsolve, tsit5_replay", "engine": "tsit5_replay", "record_s": 0.02},
            {"way": "gradsolve, other", "reason": "not accurate"},
        ],
    }
    page = told(
        MACHINE,
        {
            "gradient_tracking": OURS,
            "gradient_gradsolve": by,
            "gradient_diffrax": {"peer": "diffrax", "reason": "not installed here: set IT"},
        },
    )
    rows = page[page.index("## A gradient by all parameters, beside others") :].splitlines()
    table = [row for row in rows if row.startswith("|")]
    assert len({row.count("|") for row in table}) == 1
    assert "| gradsolve, tsit5_replay | 0.0001 | 1 | 4 | 4 | 0.01 | 5 | 2.0 |" in table
    assert any(row.startswith("| smajax, machine code | ") and " | 1 | 4 | 4 | " in row for row in table)
    assert any(row.startswith("| smajax, XLA | ") and " | 1 | 6 | 4 | " in row for row in table)
    assert any(row.startswith("| smajax, XLA, forward mode | ") and " | 10 | 10 | " in row for row in table)
    assert any("gradsolve, other" in row and "not accurate" in row for row in table)
    assert any("diffrax" in row and "not installed here" in row for row in table)
    assert "0.2 ms (tsit5_replay) a run more" in page


def test_a_page_without_these_parts_says_so() -> None:
    page = told(MACHINE, {"numba": {"peer": "numba", "reason": "not installed here: set IT"}})
    assert "| numba, float64 | not installed here: set IT | | | | |" in page
    assert "beside others" not in page
    known = {"ms_per_trajectory": 0.5, "angle_error": 0.6, "fraction_error": 0.1}
    page = told(MACHINE, {"numba": {"double": known, "float": {**known, "accurate": False}}})
    assert "| numba, float64 | 0.5 | 0.6 | 0.1 |  |  |" in page
    assert "| numba, float32, **not accurate enough** | 0.5 |" in page
