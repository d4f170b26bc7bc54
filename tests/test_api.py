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

HANGING = ("flexinol_table_3_2", "dead_weight", "flexinol_voltage")


def test_every_name_is_there_and_known_to_a_checker() -> None:
    assert sma.__version__ == version("smajax")
    text = Path(sma.__file__).read_text(encoding="utf-8")
    for name in sma.NAMES:
        assert getattr(sma, name) is not None
        assert name in dir(sma)
        assert f" as {name}\n" in text or name in ("EFFECTS", "load_experiment"), name
    assert "arm" in sma.presets.LOADS
    assert sma.EFFECTS["latent_heat"].__module__ == "smajax.effects.latent_heat"
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
    "first", ["import smajax.simulate, smajax.identify;", "from smajax.close_loop import close_loop;"]
)
def test_a_function_goes_before_the_module_of_its_name(first: str) -> None:
    code = f"{first}import smajax as sma; from smajax import simulate; from smajax.simulate import DEFAULT_STEP;"
    code += "print(callable(sma.simulate), callable(simulate), callable(sma.identify), callable(sma.close_loop))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert told.stdout.split() == ["True"] * 4


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = "import sys, smajax; print(sorted({'jax', 'numpy', 'importlib.metadata', 'typer'} & set(sys.modules)))"
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


def test_simulate_is_pure_inside_anybodys_transformations() -> None:
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
