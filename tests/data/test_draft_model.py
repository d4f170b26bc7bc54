"""Which presets a draft takes: those that the columns suggest, and any load that moves and has a reading of the log."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest

import smajax as sma
from smajax.data.experiment.column_guess import SURE, Column
from smajax.data.experiment.draft import draft
from smajax.data.experiment.draft_model import DraftModel, ModelChoice, choose_model, loads_with
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.readers.table import MeasuredDataError
from smajax.report.next_steps import PlantWords
from tests.helpers.own_load import Crank, Scheduled


def chosen(*quantities: str, load: str = "") -> DraftModel:
    return choose_model({name: Column(name, name, name, "", SURE, "") for name in quantities}, ModelChoice(load))


def test_the_loads_of_the_package_have_the_wires_of_their_benches() -> None:
    found = {
        ("voltage", "position"): ("dead_weight", "flexinol_table_3_2"),
        ("voltage", "force"): ("blocked_wire", "flexinol_table_3_2"),
        ("voltage", "angle"): ("arm", "niti_table_3_1"),
    }
    assert {columns: (chosen(*columns).load, chosen(*columns).wire) for columns in found} == found
    spring = chosen("duty", "position", "mass", load="bias_spring")
    assert spring.wire == "flexinol_ht_500um"
    assert (spring.drive, spring.inputs, spring.output) == ("duty", ("duty",), "position")
    assert chosen("duty", "position", "mass").inputs == ("duty", "mass")


def test_a_load_that_is_registered_is_drafted_by_its_reading(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As one line in the table does; its reading says with which logs it goes, and a page's next step names it."""
    steps = PlantWords(("niti_table_3_1", "crank", "voltage"))
    monkeypatch.setitem(sma.LOADS, "crank", Crank)
    monkeypatch.setitem(sma.LOADS, "scheduled", Scheduled)
    assert {"arm", "crank"} <= set(loads_with("angle"))
    assert not {"arm", "crank", "coupon"} & set(loads_with("position"))
    time = np.arange(0.0, 20.0, 0.1)
    rows = np.stack([time, 5.0 * (time % 4.0 > 2.0), 20.0 + np.sin(time)], 1)
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="time [s],U [V],angle [deg]", comments="")
    text = draft([tmp_path / "log.csv"], tmp_path / "e.toml", choice=ModelChoice("crank")).text
    (tmp_path / "e.toml").write_text(text)
    expected = {"wire": "niti_table_3_1", "load": "crank", "drive": "voltage", "parameters": {}}
    assert tomllib.loads(text)["model"] == expected
    assert (
        load_experiment(tmp_path / "e.toml", dataclasses.replace(CATALOGUE, loads=tuple(sma.LOADS))).output_name
        == "angle"
    )
    assert steps.of_experiment() == ["--wire", "niti_table_3_1", "--load", "crank", "--drive", "voltage"]
    assert chosen("voltage", "position", "mass", load="scheduled").inputs == ("voltage", "mass")
    with pytest.raises(MeasuredDataError, match=r"a reading of angle: arm or (\w+ or )*crank does"):
        chosen("voltage", "angle", load="scheduled")
    assert "`--load crank`" in chosen("voltage", "angle").why


def test_a_load_of_another_package_that_fails_is_an_error_for_who_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> None:
        raise RuntimeError("no such bench")

    monkeypatch.setitem(sma.LOADS, "broken", broken)
    assert chosen("voltage", "position").load == "dead_weight"
    with pytest.raises(MeasuredDataError, match="the load 'broken' does not go with these columns"):
        chosen("voltage", "position", load="broken")
