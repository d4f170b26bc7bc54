"""Coefficients that are measured as a load's reading or force have its unit: rad and N m on an arm."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from smajax.control.compose import with_values
from smajax.core.parameters import parameter_values, parameters
from smajax.core.units import UnitError
from smajax.data.model_catalogue import applicable
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.read import load_model
from smajax.data.model_file.record import LikelyModel, ModelParameter
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.report.narrative.values import value_text

READINGS = ("sensor_limit.lower", "sensor_offset.shift", "sensor_resolution.increment", "sensor_backlash.half_width")
FRICTIONS = ("coulomb_friction.limit", "stribeck_friction.limit")


@pytest.mark.parametrize(
    ("load", "drive", "reading", "rate", "force"),
    [
        ("arm", "voltage", "rad", "rad/s", "N m"),
        ("dead_weight", "voltage", "m", "m/s", "N"),
        ("coupon", "none", "-", "1/s", ""),
    ],
)
def test_units_of_coefficients_are_those_of_the_load(
    load: str, drive: str, reading: str, rate: str, force: str
) -> None:
    system = build("niti_table_3_1", load, drive)
    table = parameters(extended(system, applicable(system)))
    assert {table[name].unit for name in READINGS} == {reading}
    assert table["sensor_drift.rate"].unit == rate
    assert {table[name].unit for name in FRICTIONS if name in table} == ({force} if force else set())
    if load == "arm":
        assert table["coulomb_friction.bend"].unit == "m"  # of the wire's end


def test_every_coefficient_that_says_what_it_is_on_an_arm_has_that_unit_there() -> None:
    arm = build("niti_table_3_1", "arm", "voltage")
    for name in applicable(arm):
        for entry in parameters(extended(arm, (name,))).values():
            if "on an arm" in entry.about:
                assert f"{entry.unit} on an arm" in entry.about, entry.name
    assert set(LIBRARY) >= {"coulomb_friction", "sensor_limit"}


def test_a_limit_of_an_arms_sensor_is_shown_in_degrees_and_a_friction_as_a_torque() -> None:
    arm = build("niti_table_3_1", "arm", "voltage")
    table = parameters(extended(arm, ("sensor_limit", "coulomb_friction")))
    shown = {"sensor_limit.lower": -0.815, "coulomb_friction.limit": 0.002438}
    said = [value_text(value, table[name].unit, name) for name, value in shown.items()]
    assert said == ["-46.7 deg", "0.00244 N m"]


def test_a_model_file_of_an_arm_has_these_units_and_reads_those_of_before(tmp_path: Path) -> None:
    plain = model_of_presets("niti_table_3_1", "arm", "voltage")
    effects = ("coulomb_friction", "sensor_limit")
    own = {
        "coulomb_friction.limit": ModelParameter(0.0024, "fitted", 0.0, 20.0, 1e-4),
        "sensor_limit.lower": ModelParameter(-0.815, "fitted", -10.0, 10.0),
    }
    system = extended(plain.system, effects)
    rest = {
        name: ModelParameter(value, "preset", -1e9, 1e9)
        for name, value in parameter_values(system).items()
        if name.split(".")[0] in effects
    }
    model = dataclasses.replace(
        plain,
        effects=effects,
        parameters={**plain.parameters, **rest, **own},
        likely=(LikelyModel(effects, 1.0, {}),),
    )
    file = model.save(tmp_path / "model.toml")
    text = file.read_text(encoding="utf-8")
    assert 'value = "0.0024 N m", standard_error = "0.0001 N m"' in text
    assert '"sensor_limit.lower" = { value = "-0.815 rad", low = "-10 rad", high = "10 rad"' in text
    older = text.replace(' N m"', ' N"').replace(
        ' rad", low = "-10 rad", high = "10 rad"', ' m", low = "-10 m", high = "10 m"'
    )
    assert '"-0.815 m"' in older
    assert '"0.0024 N", standard_error = "0.0001 N"' in older
    (tmp_path / "older.toml").write_text(older, encoding="utf-8")
    read = load_model(tmp_path / "older.toml")
    assert read.values["sensor_limit.lower"] == pytest.approx(-0.815)
    assert read.values["coulomb_friction.limit"] == pytest.approx(0.0024)
    assert read.parameters["coulomb_friction.limit"].standard_error == pytest.approx(1e-4)


def test_a_value_is_given_in_the_unit_of_the_load_or_that_of_before() -> None:
    arm = build("niti_table_3_1", "arm", "voltage")
    for text in ("0.02 N m", "20 mN m", "0.02 N"):
        changed = with_values(arm, {"coulomb_friction.limit": text})
        assert parameter_values(changed)["coulomb_friction.limit"] == pytest.approx(0.02), text
    changed = with_values(arm, {"sensor_offset.shift": "2 deg"})
    assert parameter_values(changed)["sensor_offset.shift"] == pytest.approx(0.0349066, rel=1e-5)
    with pytest.raises(UnitError):
        with_values(arm, {"coulomb_friction.limit": "2 V"})
