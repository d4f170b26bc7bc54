"""`import smajax as sma`: few names, late, the same whatever was imported before; data sets with units; pure functions."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib
import numpy as np
import pytest

import smajax as sma
from tests.helpers.machine_code import by_machine_code

HANGING = ("flexinol_table_3_2", "dead_weight", "flexinol_voltage")


def test_every_name_is_there_and_known_to_a_checker() -> None:
    assert sma.__version__ == version("smajax")
    text = Path(sma.__file__).read_text(encoding="utf-8")
    for name in sma.NAMES:
        assert getattr(sma, name) is not None
        assert name in dir(sma)
        assert f" as {name}\n" in text or name in ("EFFECTS", "load_experiment"), name
    assert not {"sys", "Any", "NAMES", "annotations"} & set(dir(sma))  # completion shows what a user needs
    assert "arm" in sma.presets.LOADS
    assert sma.EFFECTS["latent_heat"].__module__ == "smajax.model.effects.latent_heat"
    with pytest.raises(AttributeError, match="no attribute 'simulat'; it has"):
        sma.simulat  # noqa: B018


def test_a_renamed_name_works_and_warns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sma.RENAMED, "make_system", ("build", "0.3"))
    with pytest.warns(
        DeprecationWarning, match=r"smajax\.make_system is smajax\.build now; it goes in version 0\.3"
    ) as told:
        assert sma.make_system is sma.build
    assert told[0].filename == __file__


@pytest.mark.parametrize(
    "first",
    [
        "import smajax.simulation.simulate, smajax.fit.identify;",
        pytest.param("from smajax.attribution.close_loop import close_loop;", marks=pytest.mark.slow),
    ],
)
def test_a_public_function_hides_the_module_of_its_name(first: str) -> None:
    code = f"{first}import smajax as sma; from smajax import simulate; from smajax.simulation.simulate import DEFAULT_STEP;"
    code += "print(callable(sma.simulate), callable(simulate), callable(sma.identify), callable(sma.close_loop))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert told.stdout.split() == ["True"] * 4


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = "import sys, smajax; print(sorted({'jax', 'matplotlib', 'numpy', 'importlib.metadata', 'typer'} & set(sys.modules)))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert told.stdout.strip() == "[]"


def test_a_data_set_has_units_and_can_be_drawn() -> None:
    system = sma.compose(*HANGING, values={"load_mass": "60 g"})
    found = sma.simulate_dataset(system, {"voltage": jnp.full(201, 5.0)}, dt=0.01)
    assert {name: found[name].attrs["units"] for name in ("voltage", "position", "stress", "temperature", "time")} == {
        "voltage": "V",
        "position": "m",
        "stress": "Pa",
        "temperature": "degC",
        "time": "s",
    }
    assert float(found["force"][0]) == pytest.approx(0.06 * 9.81, rel=1e-6)
    assert '"load_mass": 0.06' in found.attrs["parameters (SI)"]
    matplotlib.use("agg")
    (line,) = found["position"].plot()  # type: ignore[call-arg]
    assert line.axes.get_ylabel() == "position [m]"
    assert line.axes.get_xlabel() == "time [s]"
    matplotlib.pyplot.close("all")


def test_a_run_at_a_glance_has_labels_with_units() -> None:
    matplotlib.use("agg")
    try:
        hanging = sma.simulate_dataset(sma.compose(*HANGING), {"voltage": jnp.full(201, 5.0)}, dt=0.01)
        axes = sma.plot(hanging).axes
        assert [one.get_ylabel() for one in axes] == [
            "voltage (V)",
            "position (mm)",
            "temperature (°C)",
            "martensite fraction",
            "stress (MPa)",
        ]
        assert axes[-1].get_xlabel() == "time (s)"
        np.testing.assert_allclose(np.asarray(axes[1].lines[0].get_ydata()), 1e3 * hanging["position"])
        pulled = {"temperature": jnp.linspace(30.0, 95.0, 66), "stress": jnp.full(66, 100e6)}
        coupon = sma.simulate_dataset(sma.compose("flexinol_isobaric", "coupon", "none"), pulled, dt=1.0)
        assert [one.get_ylabel() for one in sma.plot(coupon).axes][:3] == [
            "temperature (°C)",
            "stress (MPa)",
            "strain (%)",
        ]
        loop = sma.compose("niti_table_3_1", "arm", "amplified_voltage", controller="vsc3")
        (panel,) = sma.plot(sma.simulate_loop_dataset(loop, "5 deg", seconds=1.0), ["position"]).axes
        assert panel.get_ylabel() == "position (deg)"
        np.testing.assert_allclose(np.asarray(panel.lines[1].get_ydata()), 5.0)
        with pytest.raises(ValueError, match="no series 'postion'; did you mean 'position'"):
            sma.plot(hanging, ["postion"])
        with pytest.raises(ValueError, match=r"dimensions sample, time, expected time alone"):
            sma.plot(hanging.expand_dims("sample"))
    finally:
        matplotlib.pyplot.close("all")


def test_a_loop_is_composed_in_a_line_and_run_in_another() -> None:
    names = ("niti_table_3_1", "arm", "amplified_voltage")
    loop = sma.compose(*names, effects=["latent_heat"], values={"damping": "0.004 N m s"}, controller="vsc3")
    found = sma.simulate_loop_dataset(loop, "5 deg", seconds=5.0, tolerance=None)
    units = {name: found[name].attrs["units"] for name in ("voltage", "position", "wanted", "temperature", "time")}
    assert units == {"voltage": "V", "position": "rad", "wanted": "rad", "temperature": "degC", "time": "s"}
    assert abs(np.degrees(float(found["position"][-1])) - 5.0) < 1.0
    assert '"latent_heat.enthalpy"' in found.attrs["parameters (SI)"]
    # The same as the parts by hand, and the same by name as by the controller itself.
    by_hand = by_machine_code(sma.simulate_closed_loop)(
        loop.system, loop.controller, jnp.full(found.sizes["time"], np.radians(5.0)), 0.005, 2
    )
    np.testing.assert_allclose(found["position"], by_hand.run.position, rtol=0.0, atol=1e-9)
    own = sma.compose(*names, effects=["latent_heat"], values={"damping": "0.004 N m s"}, controller=loop.controller)
    target = sma.reference.constant(sma.reference.clock(5.0, 0.005), np.radians(5.0))
    np.testing.assert_array_equal(sma.simulate_loop_dataset(own, target, tolerance=None)["position"], found["position"])
    # Each set point holds from its instant on.
    wanted = np.degrees(sma.simulate_loop_dataset(loop, "0deg:1s,10deg:1s", tolerance=None)["wanted"])
    np.testing.assert_allclose([*wanted[199:201], wanted[-1]], [0.0, 10.0, 10.0], atol=1e-12)


def test_a_composed_loop_refuses_wrong_parts_and_times() -> None:
    arm = ("niti_table_3_1", "arm", "amplified_voltage")
    loop = sma.compose(*arm, controller="pid")
    with pytest.raises(KeyError, match="no controller 'pdi'; did you mean 'pid'"):
        sma.compose(*arm, controller="pdi")
    with pytest.raises(ValueError, match=r"moves nothing that a controller could lead"):
        sma.compose("flexinol_isobaric", "coupon", "none", controller="pid")
    with pytest.raises(TypeError, match=r"expected a Loop, got System"):
        sma.simulate_loop_dataset(loop.system, 0.5, seconds=1.0)
    with pytest.raises(ValueError, match="give `seconds`"):
        sma.simulate_loop_dataset(loop, 0.5)
    with pytest.raises(ValueError, match="whole number of simulation steps"):
        sma.simulate_loop_dataset(loop, 0.5, seconds=1.0, period=0.012)
    with pytest.raises(sma.units.UnitError, match="degC"):
        sma.simulate_loop_dataset(loop, "40 degC", seconds=1.0)


def test_simulate_works_inside_jit_vmap_and_grad() -> None:
    coupon = sma.build("flexinol_isobaric", "coupon", "none")
    inputs = {"temperature": jnp.linspace(30.0, 95.0, 66), "stress": jnp.full(66, 100e6)}

    @jax.jit
    def strain(start: jax.Array) -> jax.Array:
        changed = sma.set_parameters(coupon, {"austenite_start": start})
        return sma.simulate(changed, inputs, 1.0).reading[-10]

    starts = jnp.asarray([66.0, 69.0])
    slopes = jax.vmap(jax.grad(strain))(starts)
    ahead = [float(strain(start + 1e-4) - strain(start - 1e-4)) / 2e-4 for start in starts]
    assert (np.abs(ahead) > 1e-5).all()
    np.testing.assert_allclose(slopes, ahead, rtol=1e-5)
