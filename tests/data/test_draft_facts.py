"""What is said of a bench when its experiment is drafted: known values, the wire's resistance, masses; taken whole, or refused with the reason."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from smajax.core.parameters import parameter_values
from smajax.data.experiment.draft import Draft, draft
from smajax.data.experiment.draft_facts import BenchFacts
from smajax.data.experiment.draft_model import ModelChoice
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.extend import extended
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.name_hints import hinted, mass_hint
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.base_model import base_model
from smajax.fit.uncertain_presets import values_not_given
from smajax.model.effects.prior_width import CoefficientPrior
from smajax.model.presets import build

AREA = 0.25 * math.pi * 0.31e-3**2
KNOWN = {"wire_diameter": "0.31 mm", "wire_length": "0.5 m", "damping": "100 N s/m", "latent_heat.enthalpy": "20 J/g"}


def logs(folder: Path, *names: str) -> list[Path]:
    """A voltage that switches and a position."""
    time = 0.1 * np.arange(200)
    rows = np.stack([time, 5.0 * (time % 8.0 > 4.0), 3.0 + np.sin(time)], 1)
    files = [folder / f"{name}.csv" for name in names or ("a", "b")]
    for file in files:
        np.savetxt(file, rows, delimiter=",", header="time [s],U [V],x [mm]", comments="", fmt="%.6g")
    return files


def drafted(folder: Path, *names: str, load: str = "", **facts: Any) -> Draft:
    made = draft(logs(folder, *names), folder / "e.toml", choice=ModelChoice(load), bench=BenchFacts(**facts))
    (folder / "e.toml").write_text(made.text, encoding="utf-8")
    return made


def test_known_values_are_those_of_the_base_model_and_no_longer_asked_for(tmp_path: Path) -> None:
    made = drafted(tmp_path, known={**KNOWN, "specific_heat": "500 J/kg/K"})
    experiment = load_experiment(tmp_path / "e.toml", CATALOGUE)
    values = parameter_values(base_model(experiment))
    assert values["wire_diameter"] == pytest.approx(0.31e-3)
    assert values["latent_heat.enthalpy"] == pytest.approx(2e4)
    assert values["specific_heat"] == 500.0
    assert "specific_heat" not in {one.name for one in experiment.unknowns}
    assert "# wire_diameter = " not in made.text
    assert "# load_mass = " in made.text
    assert not any("gives nothing of this bench" in one for one in experiment.warnings)


@pytest.mark.parametrize(
    ("diameter", "wire"),
    [("0.2 mm", "flexinol_table_3_2"), ("325 um", "flexinol_table_3_2"), ("0.4 mm", "flexinol_ht_500um")],
)
def test_the_wire_of_a_draft_is_the_preset_whose_diameter_is_nearest(tmp_path: Path, diameter: str, wire: str) -> None:
    """It was that of the load, 0.5 mm and high-temperature on every bias spring, whose bounds left the truth out."""
    made = drafted(tmp_path, load="bias_spring", known={"wire_diameter": diameter})
    assert tomllib.loads(made.text)["model"]["wire"] == wire
    (said,) = [one for one in made.messages if one.startswith("wire:") and "warning" not in one]
    assert said.startswith(f"wire: {wire}, since its diameter of ")
    assert ("as near to the 0.325 mm given as" if "325" in diameter else "nearer to the 0.") in said
    assert f'wire = "{wire}"  # its diameter of ' in made.text
    assert said in made.of_bench


def test_a_wire_that_is_named_stays_and_a_diameter_far_from_its_own_is_warned_of(tmp_path: Path) -> None:
    facts = BenchFacts(known={"wire_diameter": "0.2 mm"})
    for wire, far in (("flexinol_ht_500um", True), ("niti_table_3_1", False)):
        made = draft(logs(tmp_path), tmp_path / "e.toml", choice=ModelChoice("bias_spring", wire), bench=facts)
        assert tomllib.loads(made.text)["model"]["wire"] == wire
        said = [one for one in made.messages if one.startswith("wire:")]
        assert bool(said) is far
        assert all("has a diameter of 0.5 mm and yours is 0.2 mm" in one for one in said)


def test_a_diameter_that_is_none_is_refused_as_before(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match="wire_diameter"):
        drafted(tmp_path, load="bias_spring", known={"wire_diameter": "thin"})


def test_without_facts_a_draft_is_what_it_was(tmp_path: Path) -> None:
    assert drafted(tmp_path).text == draft(logs(tmp_path), tmp_path / "e.toml").text


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"wire_lenght": "0.5 m"}, "there is no parameter 'wire_lenght'"),
        ({"wire_length": "0.5"}, "got '0.5' without a unit, expected one like 'm'; write '0.5 m'"),
        ({"wire_length": "400"}, "got '400' without a unit, expected one like 'mm'; write '400 mm'"),
        ({"wire_diameter": "0.31"}, "got '0.31' without a unit, expected one like 'mm'; write '0.31 mm'"),
        ({"young_modulus_martensite": "28"}, "without a unit, expected one like 'GPa'; write '28 GPa'"),
        ({"load_mass": "120"}, "without a unit, expected one like 'g'; write '120 g'"),
        ({"density": "9"}, "got '9' without a unit; expected 1000 to 20000 kg/m^3, written like '6450 kg/m^3'"),
        ({"wire_length": "5 kg"}, "got unit 'kg', expected one like 'm', to which it cannot be converted"),
        ({"wire_diameter": "31 mm"}, r"that is 0.031 m; expected 1e-05 to 0.01 m"),
    ],
)
def test_a_known_value_is_refused_as_that_of_a_file(tmp_path: Path, known: dict[str, str], message: str) -> None:
    with pytest.raises(ExperimentError, match=r"e.toml: model.parameters") as refused:
        drafted(tmp_path, known=known)
    (name, value), *_ = known.items()
    text = draft(logs(tmp_path), tmp_path / "e.toml").text
    written = text.replace("\n[unknown]", f'{name} = "{value}"\n\n[unknown]', 1)
    (tmp_path / "e.toml").write_text(written, encoding="utf-8")
    with pytest.raises(ExperimentError) as of_file:
        load_experiment(tmp_path / "e.toml", CATALOGUE)
    assert str(refused.value) == str(of_file.value)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("facts", "per_metre"),
    [({"ohms": 6.2, "known": KNOWN}, 12.4), ({"ohms_per_metre": 8.5, "known": KNOWN}, 8.5)],
)
def test_a_resistance_gives_both_resistivities(tmp_path: Path, facts: dict[str, Any], per_metre: float) -> None:
    """R A/l_0 of the cold wire; the hot one, which nobody measured, in the ratio of Table 3.2, 84 to 76, and uncertain."""
    made = drafted(tmp_path, **facts)
    experiment = load_experiment(tmp_path / "e.toml", CATALOGUE)
    base = base_model(experiment)
    values = parameter_values(base)
    assert "resistivity_martensite" in experiment.parameters
    priors, _ = values_not_given(experiment, base)
    assert priors["resistivity_austenite"] == CoefficientPrior(values["resistivity_austenite"], 0.2, True)
    assert "resistivity_martensite" not in priors
    assert values["resistivity_martensite"] == pytest.approx(per_metre * AREA, rel=1e-3)
    assert values["resistivity_austenite"] == pytest.approx(per_metre * AREA * 84.0 / 76.0, rel=1e-3)
    (said,) = [one for one in made.messages if "of the cold wire" in one]
    assert "the preset's)" not in said
    assert ("wire_length 0.5 m" in said) == ("ohms" in facts)


def test_a_size_of_the_preset_is_named_where_a_resistance_is_computed_with_it(tmp_path: Path) -> None:
    made = drafted(tmp_path, ohms=20.0)
    own = parameter_values(build("flexinol_table_3_2", "dead_weight", "voltage"))
    area = 0.25 * math.pi * own["wire_diameter"] ** 2
    found = tomllib.loads(made.text)["model"]["parameters"]["resistivity_martensite"]
    assert found == f"{20.0 * area / 0.537:.4g} ohm m"
    (said,) = [one for one in made.messages if "of the cold wire" in one]
    assert "wire_length 0.537 m (the preset's) and wire_diameter 0.00015 m (the preset's)" in said


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"ohms": 4.0, "ohms_per_metre": 8.0}, "got a resistance and one per metre, which say the same"),
        (
            {"ohms": 4.0, "known": {"resistivity_austenite": "8e-7 ohm m"}},
            "got `resistivity_austenite` and a resistance",
        ),
        ({"ohms": 4e5}, "is the resistance in ohm, and are wire_length and wire_diameter those of this wire"),
        ({"masses": {"c": "500 g"}}, "there is no run 'c'"),
        (
            {"masses": {"a": "500"}},
            "runs.a.inputs.mass: got '500' without a unit, expected one like 'g'; write '500 g'",
        ),
        ({"masses": {"a": "1.5"}}, "write '1.5 kg'"),
        ({"mass": "0.5 m"}, "runs.a.inputs.mass: got unit 'm', expected one like 'kg'"),
        ({"mass": "1 kg", "known": {"load_mass": "1 kg"}}, "load_mass: got it and a mass of every run"),
        ({"masses": {"a": "0 g", "b": "1 kg"}}, "got '0 g'; expected more than 0 kg"),
        (
            {"masses": {"a": "500 g"}},
            "'a' has a mass; give --mass b=... too, or one --mass without a name for all the others",
        ),
    ],
)
def test_facts_that_cannot_be_are_refused(tmp_path: Path, facts: dict[str, Any], message: str) -> None:
    with pytest.raises(ExperimentError) as refused:
        drafted(tmp_path, **facts)
    assert message in str(refused.value)


def test_each_run_has_its_own_mass(tmp_path: Path) -> None:
    made = drafted(tmp_path, masses={"a": "500 g"}, known={"load_mass": "0.2 kg"})
    experiment = load_experiment(tmp_path / "e.toml", CATALOGUE)
    assert [float(run.inputs["mass"][0]) for run in experiment.runs] == [0.5, 0.2]
    assert "# load_mass" not in made.text


def test_one_mass_is_that_of_every_run_without_another(tmp_path: Path) -> None:
    drafted(tmp_path, "a", mass="0.5kg")
    (alone,) = load_experiment(tmp_path / "e.toml", CATALOGUE).runs
    assert (float(alone.inputs["mass"].min()), float(alone.inputs["mass"].max())) == (0.5, 0.5)
    drafted(tmp_path, mass="500 g", masses={"b": "1 kg"})
    assert [float(run.inputs["mass"][0]) for run in load_experiment(tmp_path / "e.toml", CATALOGUE).runs] == [0.5, 1.0]


def test_a_title_says_which_runs_of_which_bench(tmp_path: Path) -> None:
    drafted(tmp_path, "ramp")
    assert load_experiment(tmp_path / "e.toml", CATALOGUE).title == "ramp: flexinol_table_3_2, dead_weight, voltage"
    (tmp_path / "wire 2").mkdir()
    found = tomllib.loads(draft(logs(tmp_path / "wire 2"), tmp_path / "e.toml").text)["title"]
    assert found == "2 runs of wire 2: flexinol_table_3_2, dead_weight, voltage"
    assert tomllib.loads(draft(logs(tmp_path), tmp_path / "e.toml", "mine").text)["title"] == "mine"


def test_a_load_without_a_hanging_mass_takes_none(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match="flexinol_ht_500um bias_spring voltage takes no mass of each run"):
        drafted(tmp_path, load="bias_spring", masses={"a": "500 g", "b": "500 g"})
    with pytest.raises(ExperimentError, match="flexinol_ht_500um bias_spring voltage takes no mass of each run"):
        drafted(tmp_path, load="bias_spring", mass="500 g")


def test_on_an_arm_the_mass_of_a_run_is_its_payload(tmp_path: Path) -> None:
    files = logs(tmp_path, "a", "b", "c")
    for file in files:
        file.write_text(file.read_text().replace("x [mm]", "angle [deg]"), encoding="utf-8")

    def on_arm(**facts: Any) -> str:
        return draft(files[:2], tmp_path / "e.toml", choice=ModelChoice("arm"), bench=BenchFacts(**facts)).text

    text = on_arm(mass="60 g", masses={"b": "45 g"})
    (tmp_path / "e.toml").write_text(text, encoding="utf-8")
    experiment = load_experiment(tmp_path / "e.toml", CATALOGUE)
    assert experiment.parameters["payload_mass"] == 0.06
    assert [dict(run.parameters) for run in experiment.runs] == [{}, {"payload_mass": 0.045}]
    assert 'parameters = { payload_mass = "45 g" }' in text
    assert "# payload_mass = " not in text
    assert on_arm(known={"payload_mass": "60 g"}, masses={"b": "45 g"}) == text
    with pytest.raises(ExperimentError, match=r"runs\.a\.parameters\.payload_mass: is missing: 'b' has a mass; give"):
        on_arm(masses={"b": "45 g"})
    with pytest.raises(ExperimentError, match=r"model\.parameters\.payload_mass: got it and a mass of every run"):
        on_arm(mass="45 g", known={"payload_mass": "60 g"})
    with pytest.raises(ExperimentError, match="'45' without a unit, expected one like 'g'; write '45 g'"):
        on_arm(masses={"a": "45", "b": "45 g"})
    further = extended(tmp_path / "e.toml", [files[2]], tmp_path / "more.toml", {"c": "75 g"})
    (tmp_path / "more.toml").write_text(further.text, encoding="utf-8")
    assert load_experiment(tmp_path / "more.toml", CATALOGUE).runs[-1].parameters == {"payload_mass": 0.075}


def test_a_log_with_a_mass_takes_no_other(tmp_path: Path) -> None:
    files = logs(tmp_path, "a")
    rows = np.loadtxt(files[0], delimiter=",", skiprows=1)
    rows = np.insert(rows, 2, 300.0 + np.arange(200) % 7, axis=1)
    np.savetxt(files[0], rows, delimiter=",", header="time [s],U [V],mass [g],x [mm]", comments="", fmt="%.6g")
    with pytest.raises(ExperimentError, match="the logs have a mass themselves"):
        draft(files, tmp_path / "e.toml", bench=BenchFacts(masses={"a": "500 g"}))


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("step_500g", (500.0, "g")),
        ("0.5kg-ramp", (0.5, "kg")),
        ("100MPa", (100.0, "MPa")),
        ("heat 1,5 kg", (1.5, "kg")),
        ("run2", None),
        ("test3gamma", None),
        ("img500", None),
        ("2026-11-12", None),
    ],
)
def test_masses_are_seen_in_names(name: str, found: tuple[float, str] | None) -> None:
    assert hinted(name) == found


def test_a_mass_in_a_name_is_suggested_and_not_taken(tmp_path: Path) -> None:
    made = drafted(tmp_path, "step_500g", "hold_100MPa", known={"wire_diameter": "0.31 mm"})
    (hint,) = [one for one in made.messages if one.startswith("mass: ")]
    assert "nothing is taken from them" in hint
    assert "--mass 'step_500g=500 g' --mass 'hold_100MPa=0.7694 kg'" in hint  # 100 MPa on 0.0755 mm^2
    assert "inputs" not in tomllib.loads(made.text)["runs"][0]
    asked = drafted(tmp_path, "step_500g", "hold_100MPa", masses={"step_500g": "500 g", "hold_100MPa": "0.7694 kg"})
    assert not any(one.startswith("mass: ") for one in asked.messages)
    assert not any(one.startswith("mass: ") for one in drafted(tmp_path, "step_500g", load="bias_spring").messages)
    assert mass_hint(["a", "b"], 1e-4) == ""
