"""What the Python API is given in a wrong shape: the error names the leaf, its axes, and what to do."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.compose import compose
from smajax.control.loop_around import loop_around
from smajax.control.loop_dataset import simulate_loop_dataset
from smajax.core.parameters import check_bounds, set_parameters
from smajax.core.units import UnitError
from smajax.model.presets import build
from smajax.model.system import initial_state
from smajax.model.wire.laws import under_law
from smajax.simulation.batch.axes import grid, sampled, zipped
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.dataset import simulate_dataset
from smajax.simulation.simulate import simulate
from tests.helpers.machine_code import by_machine_code

SYSTEM = build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
VOLTAGE = {"voltage": jnp.full(50, 5.0)}
BATCH = set_parameters(SYSTEM, {"convection_coefficient": jnp.array([50.0, 100.0, 150.0])})


@pytest.mark.parametrize("run", [simulate, simulate_compiled, simulate_dataset])
def test_a_batch_where_one_number_is_wanted_names_the_leaf_and_its_axes(run) -> None:
    words = r"`convection_coefficient` has the axes \(3,\)\. Map over the batch: `jax\.vmap"
    with pytest.raises(ValueError, match=words):
        run(BATCH, VOLTAGE)
    rest = initial_state(SYSTEM, {"voltage": jnp.asarray(5.0)})
    two = jax.tree.map(lambda leaf: jnp.stack([leaf, leaf]), rest)
    with pytest.raises(ValueError, match=r"`initial\.wire\.temperature` has the axes \(2,\)"):
        run(SYSTEM, VOLTAGE, initial=two)
    with pytest.raises(ValueError, match=r"`dt` has the axes \(3,\)"):
        run(SYSTEM, VOLTAGE, dt=jnp.ones(3))


def test_axes_of_a_batch_that_do_not_match_are_named() -> None:
    with pytest.raises(ValueError, match=r"`convection_coefficient` has the axes \(3,\)"):
        run_batch(BATCH, {"voltage": 5.0}, grid(wire_length=[0.5, 0.6]), seconds=0.1)
    with pytest.raises(
        ValueError, match=r"zipped lists must be of one length, but there are \{'voltage': 2, 'load_mass': 3\}"
    ):
        zipped(voltage=[1.0, 2.0], load_mass=[1.0, 2.0, 3.0])
    with pytest.raises(
        ValueError, match=r"an input is a number or a series of shape \(n,\), but \{'voltage': \(3, 50\)\}"
    ):
        run_batch(SYSTEM, {"voltage": jnp.ones((3, 50))}, grid(wire_length=[0.5]), seconds=0.1)
    with pytest.raises(
        ValueError, match=r"the values of `voltage` must be a list of numbers, but their shape is \(2, 2\)"
    ):
        grid(voltage=np.ones((2, 2)))
    with pytest.raises(ValueError, match="value 1 of `voltage` is not a finite number"):
        grid(voltage=[1.0, np.nan])
    with pytest.raises(ValueError, match="bounds are two finite numbers that rise"):
        sampled(4, voltage=(2.0, 1.0))
    with pytest.raises(ValueError, match=r"`wire_lenght` is neither .*; did you mean 'wire_length'\?"):
        run_batch(SYSTEM, {"voltage": 5.0}, grid(wire_lenght=[0.5]), seconds=0.1)


@pytest.mark.parametrize("run", [simulate, simulate_compiled, simulate_dataset])
def test_inputs_of_a_wrong_shape_are_named(run) -> None:
    with pytest.raises(ValueError, match=r"the shapes are \{'voltage': \(3, 50\)\}"):
        run(SYSTEM, {"voltage": jnp.ones((3, 50))})
    with pytest.raises(ValueError, match=r"not empty, but the shapes are \{'voltage': \(0,\)\}"):
        run(SYSTEM, {"voltage": jnp.ones(0)})
    with pytest.raises(ValueError, match=r"missing: voltage; of no meaning to this load and drive: volts"):
        run(SYSTEM, {"volts": jnp.ones(3)})
    for dt in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="`dt` is the time between two samples, in seconds and above zero"):
            run(SYSTEM, VOLTAGE, dt=dt)


@pytest.mark.parametrize("run", [simulate, simulate_compiled, simulate_dataset])
def test_inputs_that_are_no_finite_numbers_are_named(run) -> None:
    with pytest.raises(ValueError, match="the input `voltage` is nan at sample 3; give finite numbers"):
        run(SYSTEM, {"voltage": jnp.array([1.0, 2.0, np.nan])})
    with pytest.raises(ValueError, match="the input `voltage` is str; expected numbers"):
        run(SYSTEM, {"voltage": "5 V"})


def test_impossible_values_are_named_before_a_run() -> None:
    with pytest.raises(ValueError, match="`martensite_finish` = 70 degC is not below `martensite_start`"):
        simulate_dataset(set_parameters(SYSTEM, {"martensite_finish": 70.0}), VOLTAGE)
    with pytest.raises(ValueError, match=r"No parameter `austenite_strat`; did you mean 'austenite_start'"):
        set_parameters(SYSTEM, {"austenite_strat": 90.0})
    with pytest.raises(ValueError, match=r"`wire_diameter` = -1 m \(from"):
        simulate_dataset(set_parameters(SYSTEM, {"wire_diameter": -1.0}), VOLTAGE)


@pytest.mark.parametrize("run", [simulate, simulate_compiled, simulate_dataset])
def test_a_known_parameter_out_of_its_bounds_is_refused(run) -> None:
    beyond = set_parameters(SYSTEM, {"wire_diameter": -1.0})
    with pytest.raises(ValueError, match=r"outside of the bounds: `wire_diameter` = -1 m \(from"):
        run(beyond, VOLTAGE)
    late = set_parameters(SYSTEM, {"austenite_start": 90.0})
    words = r"`austenite_start` = 90 degC is not below `austenite_finish` = .* degC; on heating"
    for refused in (partial(run, late, VOLTAGE), partial(check_bounds, late)):
        with pytest.raises(ValueError, match=words):
            refused()
    with pytest.raises(ValueError, match=r"`wire_diameter` = -1 m \(from"):
        run_batch(beyond, {"voltage": 5.0}, grid(wire_length=[0.5]), seconds=0.1)
    with pytest.raises(ValueError, match=r"`wire_diameter` = -1 m \(from"):
        check_bounds(beyond)


def test_a_traced_parameter_out_of_its_bounds_is_not_refused() -> None:
    def end(share: jax.Array) -> jax.Array:
        return simulate(set_parameters(SYSTEM, {"start_fraction": share}), VOLTAGE).reading[-1]

    slope = by_machine_code(jax.grad(end))
    assert all(np.isfinite(slope(jnp.asarray(share))) for share in (0.5, 1.5))
    swapped = lambda start: simulate(set_parameters(SYSTEM, {"austenite_start": start}), VOLTAGE).reading  # noqa: E731
    assert jax.eval_shape(swapped, 500.0).shape == (50,)


def test_a_loop_around_a_plant_out_of_its_bounds_is_refused() -> None:
    loop = compose("niti_table_3_1", "arm", "amplified_voltage", controller="pid")
    beyond = set_parameters(loop.system, {"payload_mass": -1.0})
    with pytest.raises(ValueError, match=r"`payload_mass` = -1 kg \(from"):
        simulate_closed_loop(beyond, loop.controller, jnp.full(3, 0.5), 0.01)
    late = set_parameters(loop.system, {"austenite_start": 90.0})
    with pytest.raises(ValueError, match=r"`austenite_start` = 90 degC is not below `austenite_finish` = 78 degC"):
        simulate_closed_loop(late, loop.controller, jnp.full(3, 0.5), 0.01)


def test_a_value_with_a_unit_is_read_and_what_is_no_value_is_refused() -> None:
    arm = build("niti_table_3_1", "arm", "amplified_voltage")
    for text in ("50 g", "0.05", "0.05 kg"):
        assert float(set_parameters(arm, {"payload_mass": text}).load.payload_mass) == pytest.approx(0.05)
    for value, words in (
        ("50 V", "got unit 'V', expected one like 'kg'"),
        ("heavy", "got 'heavy', expected a number and a unit like '1.5 kg'"),
        ("+20%", r"got '\+20%', a change of what it is, expected the value; `smajax\.compose"),
        (True, "got True, expected a number in kg"),
    ):
        with pytest.raises(UnitError, match=f"payload_mass: {words}"):
            set_parameters(arm, {"payload_mass": value})
    # Of a number without a unit a percentage is a value, and one with a sign a change.
    assert float(set_parameters(arm, {"start_fraction": "20%"}).start_fraction) == pytest.approx(0.2)
    for text in ("+20%", "-20 %", "±20%"):
        with pytest.raises(UnitError, match=r"start_fraction: got .*, a change"):
            set_parameters(arm, {"start_fraction": text})
    with pytest.raises(UnitError, match="payload_mass: got True, expected a number in kg"):
        compose("niti_table_3_1", "arm", "amplified_voltage", values={"payload_mass": True})
    with pytest.raises(UnitError, match="proportional_gain: got True, expected a number in V/rad"):
        loop_around(arm, "pid", {"proportional_gain": True})


def test_a_run_that_ends_at_another_time_than_asked_says_so() -> None:
    loop = compose("niti_table_3_1", "arm", "amplified_voltage", controller="pid")
    with pytest.warns(
        UserWarning, match=r"ends at 0\.1 s, not at the 0\.12 s asked for, .* whole steps of 0\.05 s"
    ) as told:
        found = simulate_loop_dataset(loop, 0.5, seconds=0.12, dt=0.05, period=0.05, tolerance=None)
    assert float(found["time"][-1]) == pytest.approx(0.1)
    assert told[0].filename == __file__


def test_a_parameter_passed_beside_values_is_an_error_that_names_values() -> None:
    with pytest.raises(TypeError, match=r"no argument 'damping'; a parameter goes into values=\{'damping': 100.0\}"):
        compose("flexinol_table_3_2", "dead_weight", "voltage", damping=100.0)


def test_a_gradient_through_machine_code_is_an_error_that_names_simulate() -> None:
    def last(volts: jax.Array) -> jax.Array:
        return simulate_compiled(SYSTEM, {"voltage": jnp.full(20, volts)}).reading[-1]

    for change in (jax.grad, jax.jit, jax.vmap):
        with pytest.raises(
            TypeError, match=r"no gradient, jit or vmap goes through.*use `smajax.simulation.simulate.simulate`"
        ):
            change(last)(jnp.full(2, 3.0) if change is jax.vmap else jnp.asarray(3.0))


@pytest.mark.parametrize("run", [simulate, simulate_compiled, simulate_dataset])
def test_a_wrong_type_of_system_or_inputs_is_an_error(run) -> None:
    with pytest.raises(TypeError, match="`inputs` is ndarray; expected channel -> series"):
        run(SYSTEM, np.ones(50))
    with pytest.raises(TypeError, match="a run is of a `System`, as `compose` makes it, not of str"):
        run("arm", VOLTAGE)
    with pytest.raises(ValueError, match="`dt` is a number of seconds, not '5 ms'"):
        run(SYSTEM, VOLTAGE, "5 ms")
    with pytest.raises(ValueError, match="the input `voltage` is of type complex128; expected numbers"):
        run(SYSTEM, {"voltage": np.ones(50) * 1j})


def test_one_sample_is_the_start_in_machine_code_too() -> None:
    inputs = {"voltage": jnp.ones(1)}
    one, other = simulate(SYSTEM, inputs), simulate_compiled(SYSTEM, inputs)
    assert one.time.shape == other.time.shape == (1,)
    assert float(one.stress[0]) == float(other.stress[0])


def test_arguments_of_a_wrong_kind_are_errors_that_say_what_is_expected() -> None:
    with pytest.raises(TypeError, match="`axes` is dict; expected what `grid`, `zipped` or `sampled` gives"):
        run_batch(SYSTEM, {"voltage": 5.0}, {"load_mass": [0.1]}, seconds=0.1)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="`measures` holds 'position'; expected measures"):
        run_batch(SYSTEM, {"voltage": 5.0}, grid(load_mass=[0.1]), seconds=0.1, measures=("position",))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="the values of `load_mass` must be numbers in SI, without units, not"):
        grid(load_mass=["100 g"])
    with pytest.raises(TypeError, match=r"a law is the wire's: give `system.wire`, not System"):
        under_law(SYSTEM, "brinson")
    names = ("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
    for effects in ("latent_heat", {"latent_heat": 1.0}, [3]):
        with pytest.raises(TypeError, match="expected their names in a list, such as"):
            compose(*names, effects=effects)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"convection_coefficient=\+20 may be a change without its %"):
        compose(*names, values={"convection_coefficient": "+20"})
