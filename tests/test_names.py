"""What is suggested for a name that is not known."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.catalogue import CATALOGUE
from smajax.compose import compose
from smajax.experiment.errors import ExperimentError, check_name
from smajax.measured.names import instead, listed, nearest
from smajax.parameters import set_parameters

EFFECTS = ("radiation", "coulomb_friction", "latent_heat", "rising_convection")


@pytest.mark.parametrize(
    ("name", "known", "suggested"),
    [
        ("friction", EFFECTS, "coulomb_friction"),
        ("latent", EFFECTS, "latent_heat"),
        ("radation", EFFECTS, "radiation"),
        ("Latent Heat", EFFECTS, "latent_heat"),
        ("wire_lenght", ("wire", "wire_length"), "wire_length"),
        ("duty_cycle", ("duty", "current"), "duty"),
        ("volt", ("Time [ms]", "Voltage [mV]"), "Voltage [mV]"),
        ("U", ("Time [ms]", "U [mV]"), "U [mV]"),
        ("Pair[2]", ("Pair[1]", "Pair[3]"), "Pair[1]"),
    ],
)
def test_the_nearest_name(name: str, known: tuple[str, ...], suggested: str) -> None:
    assert nearest(name, known) == f"; did you mean {suggested!r}?"


@pytest.mark.parametrize(
    ("name", "known"), [("U [mV]", ("Time [ms]", "Displ [mm]")), ("drag", EFFECTS), ("h", EFFECTS), ("x", ())]
)
def test_nothing_is_suggested_where_nothing_is_near(name: str, known: tuple[str, ...]) -> None:
    assert nearest(name, known) == ""


def test_the_sentence_with_and_without_a_suggestion() -> None:
    assert instead("dutty", ("duty", "power"), "there are") == "; did you mean 'duty'? There are: duty, power"
    assert instead("zzz", ("duty", "power"), "there are") == "; there are: duty, power"
    assert instead("dutty", ("duty", "power"), "there are", ["power"]) == "; there are: duty, power"


def test_every_name_is_listed() -> None:
    assert listed(map(str, range(40))).endswith("38, 39")
    assert listed(()) == "none"


def test_parameters_of_the_model_are_listed_before_those_of_effects() -> None:
    arm = ("niti_table_3_1", "arm", "amplified_voltage")
    system = compose(*arm, effects=["latent_heat"])
    there = CATALOGUE.describe(*arm, "").parameters
    for asked in (
        lambda: compose(*arm, effects=["latent_heat"], values={"zeta": 1.0}),
        lambda: set_parameters(system, {"zeta": 1.0}),
        lambda: check_name(Path("experiment.toml"), "unknown.zeta", "parameter", "zeta", there),
    ):
        with pytest.raises((ValueError, ExperimentError), match=r"[nN]o parameter") as told:
            asked()
        names = str(told.value).rpartition(": ")[2].rstrip(".").split(", ")
        own = [name for name in names if "." not in name]
        assert {"ambient_temperature", "start_fraction", "young_modulus_martensite"} <= set(own)
        assert names == [*sorted(own), *sorted(set(names) - set(own))]
        assert "latent_heat.enthalpy" in names
