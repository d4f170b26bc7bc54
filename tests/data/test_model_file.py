"""A model as a file: what is written is read again."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import parameter_values, set_parameters
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.read import load_model
from smajax.model.presets import build
from tests.helpers.model_files import fitted_model, same


def test_what_is_written_is_read_again_to_the_last_bit(tmp_path: Path) -> None:
    model = fitted_model()
    path = model.save(tmp_path / "model.toml")
    again = load_model(path)
    same(model, again)
    assert path.read_text(encoding="utf-8") == again.save(tmp_path / "again.toml").read_text(encoding="utf-8").replace(
        "again.nc", "model.nc"
    )
    assert sorted(one.name for one in tmp_path.iterdir()) == ["again.nc", "again.toml", "model.nc", "model.toml"]
    same(again, load_model(tmp_path))  # the folder of a model.toml


def test_values_are_in_units_of_a_data_sheet_and_read_again_to_the_last_bit(tmp_path: Path) -> None:
    model = fitted_model()
    odd = dict(model.parameters)
    for name, value in {
        "young_modulus_martensite": 28.3e9,
        "young_modulus_austenite": 75e9 / 1.0000001,  # sixteen digits in either unit
        "resistivity_austenite": 8.4e-7,
        "load_mass": 0.075,
        "wire_length": 0.537,
    }.items():
        odd[name] = dataclasses.replace(odd[name], value=value, origin="given")
    model = dataclasses.replace(model, parameters=odd)
    path = model.save(tmp_path / "model.toml")
    text = path.read_text(encoding="utf-8")
    for line in (
        'young_modulus_martensite = "28.3 GPa"',
        'resistivity_austenite = "0.84 µΩ m"',
        'load_mass = "75 g"',
        'wire_length = "0.537 m"',
        'wire_diameter = "0.31 mm"',
        'stress = ["76 MPa", "143 MPa"]',
        'noise = "0.1 mm"',
        'temperature = ["23 degC", "117.358 degC"]',
    ):
        assert f"\n{line}" in text, line
    same(model, load_model(path))
    (enthalpy,) = [one for one in text.splitlines() if one.startswith('"latent_heat.enthalpy"')]
    assert enthalpy.count(" J/g") == 4, enthalpy  # its error and bounds too


@pytest.mark.parametrize(
    "traced",
    [
        jax.jit,
        jax.grad,
        lambda function: lambda mass: jax.vmap(function)(mass[None]),
        lambda function: lambda mass: jax.jit(jax.vmap(jax.grad(function)))(mass[None]),
    ],
)
def test_a_system_first_asked_for_inside_a_traced_function_is_of_numbers(traced: Any) -> None:
    kept, fresh = fitted_model(), fitted_model()
    seen: list[Any] = []

    def force(mass: jax.Array) -> jax.Array:
        system = set_parameters(kept.system, {"load_mass": mass})
        seen[:] = [parameter_values(kept.system), kept.plants(3)]
        return jnp.sum(system.load.resistance(mass, mass, {}))

    assert np.isfinite(traced(force)(jnp.array(0.1))).all()
    assert seen[0] == parameter_values(fresh.system)
    assert kept.table == fresh.table
    for mine, theirs in zip(jax.tree.leaves(kept.system), jax.tree.leaves(fresh.system), strict=True):
        assert not isinstance(mine, jax.core.Tracer)
        assert mine == theirs
    # What is not kept may be of tracers; it is there.
    assert len(jax.tree.leaves(seen[1])) == len(jax.tree.leaves(fresh.plants(3)))


def test_presets_are_such_a_file_and_build_the_same_system(tmp_path: Path) -> None:
    path = model_of_presets("niti_table_3_1", "arm", "amplified_voltage").save(tmp_path / "arm.toml")
    model = load_model(path)
    assert parameter_values(model.system) == parameter_values(build("niti_table_3_1", "arm", "amplified_voltage"))
    assert not (tmp_path / "arm.nc").exists()


def test_a_file_by_hand_needs_its_parts_and_the_values_that_differ(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        'format = 1\n[model]\nwire = "flexinol_table_3_2"\nload = "dead_weight"\ndrive = "voltage"\n'
        'effects = ["latent_heat"]\n[parameters]\nwire_length = "420 mm"\n"latent_heat.enthalpy" = "12 J/g"\n'
        'convection_coefficient = { value = "90 W/m^2/K", origin = "fitted", standard_error = "3 W/m^2/K" }\n',
        encoding="utf-8",
    )
    model = load_model(path)
    assert model.values["wire_length"] == pytest.approx(0.42, rel=1e-12)
    assert model.values["latent_heat.enthalpy"] == 12000.0
    assert model.parameters["convection_coefficient"].standard_error == 3.0
    assert model.parameters["wire_diameter"].origin == "preset"
