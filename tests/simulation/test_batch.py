"""The batch engine: members are single runs, chunks and devices change nothing, what is stopped goes on, bad ones are told."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr

from smajax.core.checkpointed_scan import checkpointed_scan
from smajax.core.parameters import get_parameters, parameters, set_parameters, set_vector
from smajax.core.progress import Stage
from smajax.core.provenance import provenance
from smajax.engine.xla import ON_CARD
from smajax.model.presets import build
from smajax.simulation.batch.axes import Axes, grid, sampled, zipped
from smajax.simulation.batch.chunks import chunk_size, run_bytes
from smajax.simulation.batch.recipe import BatchSettings, recipe_of
from smajax.simulation.batch.run_batch import good, opened, run_batch, status_summary
from smajax.simulation.batch.single_run import single_run
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.measures import Largest, Last, Mean, MeanSquare, Smallest, TimeAbove
from smajax.simulation.observers import NOT_FINITE, RUNAWAY
from tests.helpers.machine_code import by_machine_code
from tests.helpers.often import often

ARM = build("niti_table_3_1", "arm", "amplified_voltage")
UNLIMITED = set_parameters(ARM, {"amplifier_limit": parameters(ARM)["amplifier_limit"].high})
DT, SECONDS = 0.02, 2.0
AXES = grid(voltage=[6.0, 8.0, 9.0]) * grid(payload_mass=[0.05, 0.06])


def _batch(axes: Axes = AXES, **more: object) -> xr.Dataset:
    """With one step a sample: what is chosen otherwise is chosen for all runs of a batch together."""
    settings: dict[str, Any] = {"tolerance": None, **more}
    return run_batch(ARM, {}, axes, seconds=SECONDS, dt=DT, **settings)


def test_a_run_of_a_batch_is_the_single_run() -> None:
    found = _batch(every=5)
    assert found.sizes == {"voltage": 3, "payload_mass": 2, "time": 21}
    assert found["position"].attrs["units"] == "rad"
    assert found["stress"].attrs["units"] == "Pa"
    for volts in (6.0, 9.0):
        one = simulate_compiled(set_parameters(ARM, {"payload_mass": 0.06}), {"voltage": jnp.full(101, volts)}, DT)
        here = found.sel(voltage=volts, payload_mass=0.06)
        np.testing.assert_allclose(here["position"], one.position[::5], atol=1e-9)
        np.testing.assert_allclose(here["stress"], one.stress[::5], rtol=1e-7)
    np.testing.assert_allclose(found["time"], np.arange(21) * 0.1)
    assert "All 6 runs" in status_summary(found)


def test_a_shared_series_and_a_varied_parameter_give_the_single_runs() -> None:
    volts = jnp.concatenate([jnp.full(60, 8.0), jnp.zeros(41)])
    found = run_batch(ARM, {"voltage": volts}, zipped(convection_coefficient=[60.0, 80.0]), dt=DT)
    one = simulate_compiled(set_parameters(ARM, {"convection_coefficient": 80.0}), {"voltage": volts}, DT)
    np.testing.assert_allclose(found["temperature"][1], one.temperature, rtol=1e-9)


def test_measures_are_those_of_the_trajectory_which_is_not_stored() -> None:
    measures = (
        Last("position"),
        Largest("stress"),
        Smallest("martensite_fraction"),
        Mean("temperature"),
        TimeAbove("position", -0.7),
    )
    found = _batch(keep=(), measures=measures)
    whole = _batch()
    assert "time" not in found.dims
    np.testing.assert_allclose(found["last_position"], whole["position"][..., -1], rtol=1e-12)
    np.testing.assert_allclose(found["largest_stress"], whole["stress"].max("time"), rtol=1e-12)
    np.testing.assert_allclose(found["smallest_martensite_fraction"], whole["martensite_fraction"].min("time"))
    np.testing.assert_allclose(found["mean_temperature"], whole["temperature"][..., 1:].mean("time"), rtol=1e-12)
    above = whole["position"].values > -0.7
    first = np.where(above.any(axis=-1), whole["time"].values[np.argmax(above, axis=-1)], np.inf)
    np.testing.assert_allclose(found["time_above_position"], first, atol=1e-9)
    assert found["time_above_position"].attrs["units"] == "s"


@pytest.mark.parametrize(("length", "weight"), often([(100, 1), (97, 1), (12, 9), (3, 1), (1, 1)], [(97, 1), (12, 9)]))
def test_a_checkpointed_scan_is_the_scan_and_has_its_derivatives(length: int, weight: int) -> None:
    xs = jnp.sin(jnp.arange(float(length)))

    def of(scan: Callable[..., Any], gain: jax.Array) -> jax.Array:
        end, out = scan(lambda c, x: (jnp.tanh(gain * c + x), c * x), gain * 0.1, xs, length)
        return end + (out * xs).sum()

    own = partial(of, partial(checkpointed_scan, weight=weight))
    plain = partial(of, lambda body, carry, xs, length: jax.lax.scan(body, carry, xs, length))
    for one, other in ((own, plain), (jax.grad(own), jax.grad(plain)), (jax.jacfwd(own), jax.jacfwd(plain))):
        np.testing.assert_allclose(jax.jit(one)(0.9), jax.jit(other)(0.9), rtol=1e-13)


def test_the_memory_of_a_gradient_grows_as_the_root_of_the_steps() -> None:
    def cost(start: jax.Array, steps: int) -> jax.Array:
        return checkpointed_scan(lambda c, _: (jnp.sin(c) * 1.1, None), start, None, steps)[0].sum()

    def room(steps: int) -> int:
        made = jax.jit(jax.grad(partial(cost, steps=steps))).lower(jnp.ones(500)).compile()
        return int(made.memory_analysis().temp_size_in_bytes)  # type: ignore[union-attr]

    assert room(6400) < 4.4 * room(400)


@pytest.mark.slow
def test_a_cost_of_a_batch_is_differentiated_in_reverse() -> None:
    """By every parameter at once: along any direction it is the forward derivative."""
    names = tuple(parameters(ARM))
    at = get_parameters(ARM, names)
    measures = (MeanSquare("position", jnp.linspace(-0.7, 0.2, 101), 0.1),)
    recipe = recipe_of(ARM, {}, AXES, BatchSettings(SECONDS, DT, keep=(), measures=measures))

    def cost(share: jax.Array) -> jax.Array:
        changed = eqx.tree_at(lambda one: one.system, recipe, set_vector(ARM, names, at * share))
        volts = {"voltage": jnp.asarray(8.0), "payload_mass": jnp.asarray(0.05)}
        return single_run(changed, volts)["mean_square_position"]

    one = jnp.ones(len(names))
    along = jnp.asarray(np.random.default_rng(0).standard_normal(len(names)))
    forward = by_machine_code(lambda at: jax.jvp(cost, (at,), (along,))[1])(one)
    assert float(by_machine_code(jax.grad(cost))(one) @ along) == pytest.approx(float(forward), rel=1e-9)


def test_samples_fill_the_box_and_repeat_for_a_seed() -> None:
    box = {"voltage": (5.0, 9.0), "payload_mass": (0.04, 0.07)}
    for method in ("sobol", "latin-hypercube", "random"):
        one, other = (sampled(33, box, method=method, seed=3) for _ in range(2))
        values = one.runs(0, 33)
        for name, (low, high) in box.items():
            np.testing.assert_array_equal(values[name], other.runs(0, 33)[name])
            assert values[name].min() < low + 0.15 * (high - low)
            assert values[name].max() > high - 0.15 * (high - low)
    assert (grid(a=[1, 2]) * sampled(5, b=(0.0, 1.0))).shape == (2, 5)


def test_runs_of_a_slice_are_those_of_the_whole() -> None:
    axes = grid(a=[1.0, 2.0, 3.0]) * zipped(b=[4.0, 5.0], c=[6.0, 7.0])
    whole = axes.runs(0, axes.size)
    assert [*zip(*(whole[name] for name in "abc"), strict=True)][:3] == [(1, 4, 6), (1, 5, 7), (2, 4, 6)]
    for name, values in axes.runs(2, 5).items():
        np.testing.assert_array_equal(values, whole[name][2:5])


def _files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def _stop_after(count: int):
    calls = []

    def progress(event: Stage) -> None:
        calls.append(event.share)
        if len(calls) == count:
            raise KeyboardInterrupt

    return progress


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("smajax.engine.xla.LEAST_BLOCK", 2)
    monkeypatch.setattr("smajax.simulation.batch.run_batch.chunk_size", lambda *_: 4)


def test_the_size_of_chunks_changes_no_number(small_chunks: None) -> None:
    axes = grid(voltage=np.linspace(5.0, 9.0, 11))
    some = _batch(axes)
    np.testing.assert_allclose(
        some["position"],
        np.stack([_batch(grid(voltage=[v]))["position"][0] for v in axes.runs(0, 11)["voltage"]]),
        rtol=1e-12,
    )


class Card(NamedTuple):
    """A device that is no processor, as JAX describes one."""

    platform: str = "gpu"


def test_a_chunk_on_graphics_cards_is_no_larger_than_the_batch_and_the_budget() -> None:
    settings = BatchSettings(SECONDS, DT, 1, ("position",), (), None)

    def size(axes: Axes, budget: int, cards: int) -> int:
        return chunk_size(single_run, recipe_of(ARM, {}, axes, settings), axes, budget, cast(Any, [Card()] * cards))

    many = grid(voltage=[6.0, 8.0]) * sampled(1 << 19, payload_mass=(0.04, 0.07))
    room = 4 * run_bytes(single_run, recipe_of(ARM, {}, AXES, settings), AXES)  # for one run at a time
    assert size(AXES, 1 << 30, 1) == AXES.size
    assert size(AXES, 1 << 30, 4) == 8  # two runs each, one of them twice
    assert size(AXES, 4 * room, 1) == 3  # in two chunks, each as long
    assert size(many, 1 << 40, 1) == ON_CARD
    assert size(many, 1 << 40, 2) == 2 * ON_CARD


def test_a_stopped_batch_resumes_to_the_same_bytes(small_chunks: None, tmp_path: Path) -> None:
    axes = grid(voltage=np.linspace(5.0, 9.0, 11))
    whole = _batch(axes, out=tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        _batch(axes, out=tmp_path / "stopped", progress=_stop_after(2))
    half = opened(tmp_path / "stopped")
    assert np.isnan(half["position"].values).any()
    told: list[float] = []
    _batch(axes, out=tmp_path / "stopped", progress=lambda event: told.append(event.share))
    assert told == [1.0], "one chunk was missing"
    assert _files(tmp_path / "stopped") == _files(tmp_path / "whole")
    np.testing.assert_array_equal(whole["position"], _batch(axes)["position"])
    assert float(whole["voltage"][0]) == 5.0


def test_a_grid_comes_back_from_disk_as_a_grid(tmp_path: Path) -> None:
    kept, held = _batch(out=tmp_path / "grid"), _batch()
    xr.testing.assert_equal(kept, held)
    assert kept["stress"].attrs == held["stress"].attrs
    for name in ("version of smajax", "parameters (SI)", "input voltage"):
        assert name in kept.attrs or name == "input voltage"


def test_a_result_names_a_commit_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    assert "git" not in provenance(build("flexinol_table_3_2", "dead_weight", "voltage"))


def test_another_batch_in_the_folder_is_not_touched(tmp_path: Path) -> None:
    _batch(out=tmp_path / "batch")
    before = _files(tmp_path / "batch")
    with pytest.raises(ValueError, match="another batch"):
        _batch(grid(voltage=[6.0, 8.0, 9.1]) * grid(payload_mass=[0.05, 0.06]), out=tmp_path / "batch")
    assert _files(tmp_path / "batch") == before


def test_runs_that_go_wrong_are_reported_and_change_no_other() -> None:
    """Under ten times the voltage a wire heats without end; a torque near the largest number has no finite acceleration."""
    axes = zipped(convection_coefficient=[70.0, 70.0, 90.0], voltage=[7.0, 70.0, 7.0])
    found = run_batch(UNLIMITED, {}, axes, seconds=SECONDS, dt=DT)
    assert found["status"].values.tolist() == [0, RUNAWAY, 0]
    assert 0.0 < float(found["first_bad_time"][1]) < SECONDS
    axes = zipped(convection_coefficient=[70.0, 90.0], voltage=[7.0, 7.0])
    alone = run_batch(UNLIMITED, {}, axes, seconds=SECONDS, dt=DT)
    np.testing.assert_array_equal(found["position"][[0, 2]], alone["position"])
    assert np.isnan(good(found)["position"][1]).all()
    assert "1 of 3 runs (33.33%) went wrong, the first after " in status_summary(found)
    overflown = run_batch(ARM, {"voltage": 7.0}, grid(load_torque=[0.0, 1e308]), seconds=SECONDS, dt=DT)
    assert overflown["status"].values.tolist() == [0, NOT_FINITE]


@pytest.mark.parametrize(
    ("axes", "more", "told"),
    [
        (Axes(()), {}, "varies nothing"),
        (grid(voltage=[6.0]), {"every": 3}, "divisor"),
        (grid(voltage=[6.0]), {"seconds": None}, "seconds"),
        (grid(volts=[6.0]), {}, "`volts` is neither a parameter nor an input"),
        (
            grid(voltage=[6.0], payload_mas=[0.05]),
            {},
            r"`payload_mas` is .*; did you mean 'payload_mass'\? `smajax\.param",
        ),
        (grid(voltage=[6.0]), {"seconds": -1.0}, "`seconds` is the length of the run, a number above zero, not -1.0"),
        (grid(voltage=[6.0]), {"seconds": float("nan")}, "a number above zero, not nan"),
        (grid(voltage=[6.0]), {"seconds": "1 s"}, "a number above zero, not '1 s'"),
        (grid(voltage=[6.0]), {"seconds": 0.001}, "a run of 0.001 s is shorter than a step of 0.02 s"),
        (
            grid(voltage=[6.0]),
            {"measures": (Last("position"),), "slopes": ("payload_mas",)},
            "not `payload_mas`; did you mean 'payload_mass'",
        ),
        (grid(payload_mass=[0.1]), {}, "needs the inputs"),
        (grid(voltage=[6.0]), {"keep": ("angle",)}, "martensite_fraction"),
        (grid(ambient_temperature=[20.0]), {"inputs": {"voltage": 6.0, "ambient_temperature": 25.0}}, "of one"),
        (grid(voltage=[6.0]), {"measures": (Last("stress"), Last("stress"))}, "names of their own"),
        (grid(voltage=[6.0]), {"budget": 1000}, "every"),
        (grid(voltage=[6.0]), {"measures": (MeanSquare("position", jnp.zeros(100)),)}, "100 steps takes 101 values"),
        (grid(voltage=[6.0]), {"measures": (MeanSquare("position", jnp.zeros((1, 101))),)}, "batches of their own"),
    ],
)
def test_arguments_that_do_not_fit_together_are_errors(axes: Axes, more: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        run_batch(ARM, axes=axes, **{"inputs": {}, "seconds": SECONDS, "dt": DT, **more})  # type: ignore[arg-type]


@pytest.mark.parametrize("axes", [AXES, zipped(payload_mass=[0.05, 0.06], voltage=[6.0, 7.0])])
def test_a_varied_parameter_has_its_unit_in_memory_and_on_disk(axes: Axes, tmp_path: Path) -> None:
    here = _batch(axes, keep=(), measures=(Last("position"),))
    _batch(axes, keep=(), measures=(Last("position"),), out=tmp_path / "batch")
    for found in (here, opened(tmp_path / "batch")):
        assert found["voltage"].attrs["units"] == "V"
        assert found["payload_mass"].attrs["units"] == "kg"


def test_wrong_values_of_axes_are_errors() -> None:
    with pytest.raises(ValueError, match="one length"):
        zipped(a=[1.0, 2.0], b=[1.0])
    with pytest.raises(ValueError, match="value 1 of `a`"):
        grid(a=[1.0, float("nan")])
    with pytest.raises(ValueError, match="more than once"):
        grid(a=[1.0]) * grid(a=[2.0])
    with pytest.raises(ValueError, match="latin-hypercube"):
        sampled(4, a=(0.0, 1.0), method="grid")
    for count in (3.5, 0, -1, True, "4"):
        with pytest.raises(ValueError, match=f"a whole number of 1 or more, not {count!r}"):
            sampled(count, a=(0.0, 1.0))  # type: ignore[arg-type]
    assert sampled(np.int64(3), a=(0.0, 1.0)).size == 3  # type: ignore[arg-type]


def test_runs_that_end_at_another_time_than_asked_say_so() -> None:
    with pytest.warns(UserWarning, match=r"ends at 0\.1 s, not at the 0\.12 s asked for") as told:
        found = run_batch(ARM, {}, grid(voltage=[6.0]), seconds=0.12, dt=0.05, tolerance=None)
    assert float(found["time"][-1]) == pytest.approx(0.1)
    assert told[0].filename == __file__


SEVERAL = """
import sys
from smajax.core.runtime import prepare
prepare()
import jax
jax.config.update("jax_num_cpu_devices", int(sys.argv[1]))
import numpy as np
from smajax.engine import xla
xla.LEAST_BLOCK = 4
from tests.simulation.test_batch import _batch, grid
assert jax.local_device_count() == int(sys.argv[1])
np.save(sys.argv[2], _batch(grid(voltage=np.linspace(5.0, 9.0, 13)))["position"].values)
"""


@pytest.mark.slow
def test_the_number_of_devices_changes_no_number(tmp_path: Path) -> None:
    folder = Path(__file__).parents[2]
    for count in (1, 4):
        subprocess.run(
            [sys.executable, "-c", SEVERAL, str(count), str(tmp_path / f"{count}.npy")],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(folder)},
            check=True,
        )
    one, four = (np.load(tmp_path / f"{count}.npy") for count in (1, 4))
    # Not the same bits: a loop over two blocks is compiled otherwise than one over four.
    np.testing.assert_allclose(one, four, rtol=1e-11)
