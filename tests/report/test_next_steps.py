"""What a page suggests: each command is one that smajax reads, with the files that the page's own command wrote."""

from __future__ import annotations

import dataclasses
import html
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer

import smajax as sma
from smajax.attribution.findings import Remaining
from smajax.cli.main import app
from smajax.control.run_request import RunRequest, run_open
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.record import FittedRun
from smajax.report import next_steps
from smajax.report.next_steps import ARM, PlantWords, Step
from smajax.report.write import write_report
from tests.helpers.made_findings import made_findings
from tests.helpers.small_bench import bench, log, refused, smajax

FOLDER = Path("my bench/report")
SPRING = PlantWords(("flexinol_ht_500um", "bias_spring", "voltage"), values=("wire_length='1 m'",))
FITTED = PlantWords(model="report/model.toml", other="other/model.toml")


def read(steps: Sequence[Step]) -> list[dict[str, Any]]:
    """The options of every command, as the command line reads them; a line that it does not read is an error."""
    group = typer.main.get_command(app)
    found = []
    for line in (one.command for one in steps if one.command):
        program, name, *words = shlex.split(line)
        assert program == "smajax"
        command = group.commands[name]  # type: ignore[attr-defined]
        with command.make_context(name, words) as context:
            found.append({"command": name, **context.params})
    return found


def test_the_commands_of_a_fitted_model_are_read_and_name_its_files() -> None:
    model = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage")
    findings = dataclasses.replace(made_findings(), base_model=model, extended_model=model)
    found = {
        one["command"]: one for one in read(next_steps.after_close_loop(findings, FOLDER, "my bench/experiment.toml"))
    }
    assert (
        found["predict"]["model"] == found["tune"]["model"] == found["new-experiment"]["model"] == FOLDER / "model.toml"
    )
    assert found["export"]["file"] == FOLDER / "model.toml"
    assert found["identify"]["experiment"] == Path("my bench/experiment.toml")
    assert found["identify"]["design"] is True
    assert "close-loop" not in found
    stopped = dataclasses.replace(findings, remaining=Remaining.CHECKS)
    first = read(next_steps.after_close_loop(stopped, FOLDER, "my bench/experiment.toml"))[0]
    assert (first["command"], first["experiment"], first["out"]) == (
        "close-loop",
        Path("my bench/experiment.toml"),
        FOLDER,
    )


def test_an_identification_suggests_a_design_unless_it_has_one() -> None:
    model = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage")
    for suggestions, expected in (((), True), (("a run",), False)):
        for given in ((), ("convection_coefficient",)):
            result: Any = SimpleNamespace(model=model, suggestions=suggestions, fitted_presets=given)
            found = read(next_steps.after_identify(result, FOLDER, "experiment.toml"))
            designs = [one for one in found if one["command"] == "identify"]
            assert bool(designs) == expected
            assert [str(one["presets"]) for one in designs] == ["fitted" if given else "held"] * len(designs)


def test_no_controller_is_suggested_for_what_does_not_move() -> None:
    blocked = model_of_presets("flexinol_table_3_2", "blocked_wire", "voltage")
    found = read(next_steps.after_predict(blocked, "report/model.toml", ["logs/a b.csv", "logs/c.csv"]))
    assert [one["command"] for one in found] == ["new-experiment", "export"]
    assert found[0]["files"] == [Path("logs/a b.csv"), Path("logs/c.csv")]


def test_a_model_is_fitted_again_to_the_runs_of_before_too_where_their_file_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = bench(tmp_path / "mine")
    new, held_out = log(tmp_path / "mine" / "c.csv", seed=3), tmp_path / "mine" / "b.csv"
    model = dataclasses.replace(
        model_of_presets("flexinol_table_3_2", "dead_weight", "voltage"),
        made_with={"experiment": "experiment.toml"},
        runs=(FittedRun("A", "fit", ""), FittedRun("B", "held-out", "")),
    )
    kept = str(tmp_path / "mine" / "model.toml")
    (again, *_) = read(next_steps.after_predict(model, kept, [str(held_out), str(new)]))
    assert (again["files"], again["runs_of"].resolve(), again["out"].name) == ([new], file, "again.toml")
    assert smajax("new-experiment", new, "--with-runs-of", file, "--out", file.with_name("again.toml")).code == 0
    extended = sma.load_experiment(file.with_name("again.toml"))
    assert [(one.name, one.role) for one in extended.runs] == [("A", "fit"), ("B", "held-out"), ("c", "fit")]
    assert file.with_name("again.toml").read_text().startswith(file.read_text().rstrip())
    # Of the runs of the file alone there is nothing to add; without its file the model stands for the old runs, which is said.
    assert "new-experiment" not in [
        one["command"] for one in read(next_steps.after_predict(model, kept, [str(held_out)]))
    ]
    step = next_steps.after_predict(model, str(tmp_path / "elsewhere" / "model.toml"), [str(new)])[0]
    assert "in the place of the runs of before" in step.what
    assert "--model" in step.command


@pytest.mark.parametrize(
    ("logs", "said"),
    [
        (["mine/a.csv"], "is the log of run 'A'"),
        (["mine/A.csv"], "has a run of that name"),
        (["c.csv"], "is out of the data folder"),
    ],
)
def test_a_log_that_cannot_be_added_is_refused(tmp_path: Path, logs: list[str], said: str) -> None:
    file = bench(tmp_path / "mine")
    for name in logs:
        if not (tmp_path / name).exists():
            log(tmp_path / name, seed=3)
    out = file.with_name("again.toml")
    words = [str(tmp_path / name) for name in logs]
    assert said in refused("new-experiment", *words, "--with-runs-of", file, "--out", out)
    assert "is in another folder" in refused(
        "new-experiment", *words, "--with-runs-of", file, "--out", tmp_path / "e.toml"
    )
    assert "leave their options out" in refused(
        "new-experiment", *words, "--with-runs-of", file, "--load", "arm", "--out", out
    )
    assert not out.exists()


@pytest.mark.parametrize("plant", [ARM, SPRING, FITTED])
def test_the_commands_of_gains_and_sweeps_are_read_and_name_the_plant(plant: PlantWords) -> None:
    steps = next_steps.after_tune(FOLDER, plant, "gains.json", (4.0, 12.0), "mm", 30.0)
    steps += next_steps.after_sweep(FOLDER, plant, "sld", (4.0, 12.0), "mm", "my gains.json")
    steps += next_steps.after_sweep(FOLDER, plant, "sld", (4.0, 12.0), "mm")
    found = read(steps)
    assert [one["command"] for one in found] == [
        "sweep",
        "simulate",
        "export",
        "simulate",
        "export",
        "simulate",
        "tune",
    ]
    assert found[1]["set_point"] == "12mm:30s,4mm:30s"
    for one in found:
        assert str(one["model"] or "") == plant.model
        assert tuple(one["values"] or ()) == plant.values
        assert not plant.parts or (one["wire"], one["load"], one["drive"]) == plant.parts
        assert one["command"] == "export" or str(one["plant"] or "") == plant.other


def test_a_run_suggests_a_set_point_that_it_reached() -> None:
    ran = run_open(RunRequest(inputs={"voltage": "7:2s"}, dt=0.01))
    loop, tune, fit = read(next_steps.after_simulate(ran, ARM))
    low, high = (float(ran.data["position"].min()), float(ran.data["position"].max()))
    degrees = float(loop["set_point"].partition("deg")[0])
    assert low < degrees * np.pi / 180.0 < high
    assert (loop["controller"], tune["controller"], fit["command"]) == ("pid", "pid", "new-experiment")


def test_the_page_has_the_lines_as_they_are_typed(tmp_path: Path, blank_pictures: None) -> None:
    model = model_of_presets("flexinol_table_3_2", "dead_weight", "voltage")
    folder = tmp_path / "a 'quoted' & folder"
    page = write_report(dataclasses.replace(made_findings(), base_model=model, extended_model=model), folder)
    lines = [
        html.unescape(one) for one in re.findall(r"<code class=line>(.*?)</code>", page.read_text(encoding="utf-8"))
    ]
    assert [Path(words[2]) for line in lines if (words := shlex.split(line))[:2] == ["smajax", "predict"]] == [
        folder / "model.toml"
    ]
