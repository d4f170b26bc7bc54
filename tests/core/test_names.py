"""What is suggested for a name that is not known."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.control.compose import compose
from smajax.core.names import close_matches, listed, nearest, of_many
from smajax.core.parameters import set_parameters
from smajax.data.experiment.errors import ExperimentError, check_parameter
from smajax.data.model_catalogue import CATALOGUE

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
def test_the_nearest_name_is_suggested(name: str, known: tuple[str, ...], suggested: str) -> None:
    assert nearest(name, known) == f"; did you mean {suggested!r}?"


@pytest.mark.parametrize(
    ("name", "known"), [("U [mV]", ("Time [ms]", "Displ [mm]")), ("drag", EFFECTS), ("h", EFFECTS), ("x", ())]
)
def test_nothing_is_suggested_where_nothing_is_near(name: str, known: tuple[str, ...]) -> None:
    assert nearest(name, known) == ""


def test_the_sentence_lists_the_names_with_and_without_a_suggestion() -> None:
    assert close_matches("dutty", ("duty", "power"), "there are") == "; did you mean 'duty'? There are: duty, power"
    assert close_matches("zzz", ("duty", "power"), "there are") == "; there are: duty, power"
    assert close_matches("dutty", ("duty", "power"), "there are", ["power"]) == "; there are: duty, power"


def test_every_name_is_listed() -> None:
    assert listed(map(str, range(40))).endswith("38, 39")
    assert listed(()) == "none"


def test_of_very_many_names_the_nearest_three_and_the_listing_command_are_named() -> None:
    many = ("martensite_start", "martensite_finish", "austenite_start", "latent_heat.enthalpy", "wire_length")
    assert of_many("wire_lenght", many, "`x` lists all") == "; did you mean 'wire_length'? `x` lists all"
    told = of_many("martensite", many, "all: `x`")
    assert told == "; did you mean 'martensite_start' or 'martensite_finish'? All: `x`"
    assert of_many("_start", [f"a{k}_start" for k in range(9)], "x").count("'") == 2 * 3
    assert of_many("zeta", many, "`x` lists all") == "; `x` lists all"
    assert of_many("zeta", (), "`x` lists all") == "; `x` lists all"


def test_a_misspelt_parameter_is_answered_with_close_matches_only() -> None:
    arm = ("niti_table_3_1", "arm", "amplified_voltage")
    system = compose(*arm, effects=["latent_heat"])
    there = CATALOGUE.describe(*arm, "").parameters
    for name, near in (("austenite_strat", "did you mean 'austenite_start'? "), ("zeta", "")):
        for asked, lists in (
            (lambda name: compose(*arm, values={name: 1.0}), "`smajax presets WIRE LOAD DRIVE` lists"),
            (lambda name: set_parameters(system, {name: 1.0}), "`smajax.parameter_values(model)` lists"),
            (
                lambda name: check_parameter(Path("e.toml"), f"unknown.{name}", name, there, " ".join(arm)),
                "`smajax presets niti_table_3_1 arm amplified_voltage` lists",
            ),
        ):
            with pytest.raises((ValueError, ExperimentError), match=r"[nN]o parameter") as told:
                asked(name)
            assert f"; {near}{lists}" in str(told.value)
            assert "wire_diameter" not in str(told.value)
