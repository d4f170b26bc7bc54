"""The state of a folder, the draft from its logs, and single changes of its experiment file."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient

from smajax.app.project import EXPERIMENT, Project, read_project
from smajax.data.experiment.schema import read_schema
from tests.helpers.command_line import smajax_in
from tests.helpers.small_bench import table


def state(folder: Path) -> Project:
    return read_project(folder.resolve(), "")


def test_a_folder_is_read_as_a_record_whose_stamp_changes_with_it(folder: Path, client: TestClient) -> None:
    before = state(folder)
    assert (before.text, before.results, before.job) == ("", (), None)
    assert [log.samples for log in before.logs] == [120, 120, 120]
    assert state(folder).stamp == before.stamp
    (folder / "fourth.csv").write_bytes((folder / "first.csv").read_bytes())
    assert state(folder).stamp != before.stamp
    (folder / "report").mkdir()
    (folder / "report" / "report.html").write_text("", encoding="utf-8")
    (folder / "report" / "runs.csv").write_text("a\n1\n2\n", encoding="utf-8")
    after = state(folder)
    assert [one.command for one in after.results] == ["close-loop"]
    assert "runs.csv" not in [one.name for one in after.log_paths]  # a result is no log


def test_the_draft_is_that_of_the_command_line(folder: Path, drafted: TestClient, tmp_path: Path) -> None:
    drafted.get("/influences")  # orders the presets by their influence, as the command does
    ours = (folder / EXPERIMENT).read_text(encoding="utf-8")
    logs = [str(folder / f"{name}.csv") for name in ("first", "second", "third")]
    theirs = folder / "theirs.toml"
    ended = smajax_in("new-experiment", *logs, "--out", str(theirs), cwd=tmp_path)
    assert ended.code == 0, ended.said
    assert ours == theirs.read_text(encoding="utf-8")


def test_a_log_from_the_browser_is_read_before_it_is_kept(folder: Path, client: TestClient) -> None:
    good = (folder / "first.csv").read_bytes()
    answer = client.post(
        "/logs",
        data={"do": "upload"},
        files=[("files", ("../../new.csv", good)), ("files", ("bad.csv", b"\x00\x01\x02"))],
    )
    assert answer.status_code == 422
    assert (folder / "logs" / "new.csv").read_bytes() == good
    assert "bad.csv was not taken" in answer.text
    assert not (folder / "logs" / "bad.csv").exists()
    assert not (folder.parent / "new.csv").exists()
    other = client.post(
        "/logs", data={"do": "upload"}, files={"files": ("new.csv", (folder / "second.csv").read_bytes())}
    )
    assert "has another file of this name already" in other.text
    assert (folder / "logs" / "new.csv").read_bytes() == good
    wrong = client.post("/logs", data={"do": "upload"}, files={"files": ("sheet.xlsx", b"PK")})
    assert "files ending in" in wrong.text
    assert client.post("/logs", data={"do": "upload"}, files={"files": ("new.csv", good)}).status_code == 200


def test_a_column_is_another_one_and_the_rest_of_the_file_stays(folder: Path, drafted: TestClient) -> None:
    before = (folder / EXPERIMENT).read_text(encoding="utf-8")
    assert drafted.post("/columns", data={"channels.position.unit": "um"}).status_code == 200
    assert "[channels.position]  # likely: heading; unit by magnitude\n" in before
    expected = before.replace('unit = "mm"', 'unit = "um"').replace(
        "position]  # likely: heading; unit by magnitude", "position]"
    )
    assert (folder / EXPERIMENT).read_text(encoding="utf-8") == expected
    drafted.post("/columns", data={"column.x": "angle"})
    file = read_schema(folder / EXPERIMENT)
    assert "position" not in file.channels
    assert (file.channels["angle"].column, file.channels["angle"].role) == ("x", "output")
    found = state(folder).examined
    assert "the model has no output 'angle'" in found.errors["channels.angle"]
    page = drafted.get("/columns").text
    assert "the model has no output" in page
    drafted.post("/columns", data={"column.x": ""})
    assert "angle" not in read_schema(folder / EXPERIMENT).channels


def test_an_error_of_the_file_is_that_of_the_command_and_stands_beside_its_field(
    folder: Path, drafted: TestClient, tmp_path: Path
) -> None:
    answer = drafted.post("/bench", data={"model.parameters.wire_length": "5 V"})
    assert answer.status_code == 200
    at = answer.text.split('id="e-model.parameters.wire_length"')[1][:400]
    message = re.search(r'class="error lines">([^<]*)<', at)
    assert message is not None
    said = message[1].replace("&#39;", "'")
    ended = smajax_in("close-loop", str(folder / EXPERIMENT), "--out", str(tmp_path / "out"), cwd=tmp_path)
    assert ended.code == 2
    assert f"model.parameters.wire_length: {said}" in ended.said
    assert 'aria-invalid="true"' in answer.text


def test_another_load_keeps_what_was_said(folder: Path, drafted: TestClient) -> None:
    for address, data in (
        ("/bench", {"model.parameters.wire_length": "0.5 m"}),
        ("/columns", {"channels.position.noise": "0.1 mm"}),
        ("/runs", {"runs.first.role": "held-out"}),
        ("/runs", {"runs.second.end": "10 s"}),
        ("/runs", {"unknown.specific_heat.high": "900 J/(kg K)"}),
    ):
        assert drafted.post(address, data=data).status_code == 200
    answer = drafted.post("/bench", data={"model.load": "bias_spring"})
    assert answer.status_code == 200
    file = read_schema(folder / EXPERIMENT)
    assert file.model.load == "bias_spring"
    assert file.model.parameters["wire_length"] == "0.5 m"
    assert file.channels["position"].noise == "0.1 mm"
    assert [run.role for run in file.runs] == ["held-out", "fit", "held-out"]
    assert file.runs[1].end == "10 s"
    refused = drafted.post("/bench", data={"model.load": "blocked_wire"})
    assert refused.status_code == 422
    assert "does not go with these columns" in refused.text
    assert read_schema(folder / EXPERIMENT).model.load == "bias_spring"


def test_a_reason_goes_with_the_value_that_it_was_given_for(folder: Path, drafted: TestClient) -> None:
    """A comment of the draft that says why is dropped where the value is changed; a person's, and one that is true of any value, stays."""
    path = folder / EXPERIMENT
    text = path.read_text(encoding="utf-8")
    assert text.count('[[runs]]\n# Runs of role "fit" are fitted; those of role "held-out" are not') == 1
    text = text.replace('role = "held-out"', 'role = "held-out"  # not fitted: the error on it validates the model')
    text = text.replace('name = "first"\nrole = "fit"', 'name = "first"\nrole = "fit"  # of Monday')
    path.write_text(text, encoding="utf-8")
    assert "\n[channels.position]  # " in text
    drafted.post("/runs", data={"runs.first.role": "held-out"})
    drafted.post("/runs", data={"runs.third.role": "fit"})
    drafted.post("/columns", data={"channels.position.unit": "cm"})
    after = path.read_text(encoding="utf-8")
    assert 'role = "held-out"  # of Monday\n' in after
    assert '[[runs]]\n# Runs of role "fit" are fitted; those of role "held-out" are not' in after
    assert "# not fitted" not in after
    assert "\n[channels.position]\n" in after
    assert "\n[channels.voltage]  # " in after
    assert '# or its sigma, such as "0.01 mm"' in after


def test_an_unknown_is_added_and_taken_away(folder: Path, drafted: TestClient) -> None:
    drafted.post("/bench", data={"model.parameters.density": "6400 kg/m^3"})
    drafted.post("/runs", data={"unknown.new": "density"})
    file = read_schema(folder / EXPERIMENT)
    assert file.unknown["density"].start == "6450 kg/m^3"
    assert "density" not in file.model.parameters
    drafted.post("/runs", data={"unknown.density.free": "off"})
    assert "density" not in read_schema(folder / EXPERIMENT).unknown


def test_the_resistance_of_the_wire_gives_its_resistivities(folder: Path, drafted: TestClient) -> None:
    drafted.post("/bench", data={"model.parameters.wire_length": "0.5 m"})
    drafted.post("/bench", data={"model.parameters.wire_diameter": "0.15 mm"})
    wrong = drafted.post("/bench", data={"do": "resistance", "ohms": "a lot", "ohms_of": "wire"})
    assert wrong.status_code == 422
    assert drafted.post("/bench", data={"do": "resistance", "ohms": "20", "ohms_of": "wire"}).status_code == 200
    given = str(read_schema(folder / EXPERIMENT).model.parameters["resistivity_martensite"])
    assert float(given.split()[0]) == pytest.approx(20.0 / 0.5 * np.pi / 4 * 0.15e-3**2, rel=1e-3)
    file = read_schema(folder / EXPERIMENT)
    likely = str(file.priors.presets["resistivity_austenite"].base)
    assert float(likely.split()[0]) == pytest.approx(84.0 / 76.0 * float(given.split()[0]), rel=1e-3)
    assert likely in drafted.get("/bench").text
    drafted.post("/bench", data={"model.parameters.resistivity_austenite": "8e-7 ohm m"})
    file = read_schema(folder / EXPERIMENT)
    assert ("resistivity_austenite" in file.model.parameters, file.priors.presets) == (True, {})


def test_columns_without_headings_can_be_chosen(tmp_path: Path, folder: Path, client: TestClient) -> None:
    for path in folder.glob("*.csv"):
        t, u, x = np.loadtxt(path, delimiter=",", skiprows=1).T
        table(path, t, x, u, heading="")
        path.write_text("\n".join(path.read_text(encoding="utf-8").splitlines()[1:]) + "\n", encoding="utf-8")
    client.post("/logs", data={"use": ["first.csv", "second.csv"], "do": "draft"})
    client.post("/columns", data={"column.2": "angle"})
    client.post("/columns", data={"channels.angle.unit": "deg"})
    answer = client.post("/bench", data={"model.load": "arm", "model.wire": "niti_table_3_1"})
    assert answer.status_code == 200, re.findall(r'class="error lines">([^<]*)<', answer.text)
    file = read_schema(folder / EXPERIMENT)
    assert (file.model.load, file.channels["angle"].column, file.channels["angle"].unit) == ("arm", 2, "deg")


def test_a_folder_within_is_a_project_of_its_own(folder: Path, client: TestClient) -> None:
    assert client.post("/folder", data={"name": "../out"}).status_code == 422
    answer = client.post("/folder", data={"name": "other bench"})
    assert str(answer.url).endswith("/logs?folder=other%20bench")
    good = (folder / "first.csv").read_bytes()
    client.post("/logs?folder=other%20bench", data={"do": "upload"}, files={"files": ("a.csv", good)})
    assert (folder / "other bench" / "logs" / "a.csv").read_bytes() == good
    answer = client.post("/logs?folder=other%20bench", data={"use": "logs/a.csv", "do": "draft"})
    assert answer.status_code == 200
    assert read_schema(folder / "other bench" / EXPERIMENT).runs[0].name == "a"
    assert not (folder / EXPERIMENT).exists()


@pytest.mark.parametrize("text", ["[model", "\udcff", "title = 1\n"])
def test_a_file_that_was_broken_by_hand_is_shown_with_its_error(folder: Path, client: TestClient, text: str) -> None:
    (folder / EXPERIMENT).write_bytes(text.encode("utf-8", "surrogateescape"))
    for step in ("folder", "logs", "columns", "bench", "runs", "fit", "result", "predict", "tune", "download"):
        answer = client.get(f"/{step}")
        assert answer.status_code == 200, step
        assert 'class="error box"' in answer.text
    answer = client.post("/runs", data={"runs.first.role": "fit"})
    assert answer.status_code in (200, 422)
    client.post("/logs", data={"use": "first.csv", "do": "draft"})
    after = (folder / EXPERIMENT).read_bytes()
    assert after == text.encode("utf-8", "surrogateescape") or b"[[runs]]" in after


def test_logs_of_another_folder_join_the_experiment(folder: Path, client: TestClient) -> None:
    (folder / "logs").mkdir()
    (folder / "first.csv").rename(folder / "logs" / "first.csv")
    client.post("/logs", data={"use": "logs/first.csv", "do": "draft"})
    client.post("/runs", data={"runs.first.end": "10 s"})
    client.post("/logs", data={"use": ["logs/first.csv", "second.csv"], "do": "draft"})
    file = read_schema(folder / EXPERIMENT)
    assert [(run.name, run.file, run.end) for run in file.runs] == [
        ("first", "logs/first.csv", "10 s"),
        ("second", "second.csv", None),
    ]
    assert state(folder).examined.errors == {}


@pytest.mark.parametrize(
    ("key", "name"), [("coefficients_at_bounds", "wrong_load.share"), ("unknowns_at_bounds", "austenite_start")]
)
def test_a_result_that_ends_at_a_bound_is_not_green(folder: Path, client: TestClient, key: str, name: str) -> None:
    (folder / "report").mkdir()
    (folder / "report" / "report.html").write_text("", encoding="utf-8")
    record = {"verdict": "explained", key: [name], "runs": []}
    (folder / "report" / "report.json").write_text(json.dumps(record), encoding="utf-8")
    page = client.get("/result").text
    assert "Verdict: explained, at a bound" in page
    assert '<section class="answer fair">' in page


def test_a_result_that_held_out_runs_do_not_confirm_is_not_green(folder: Path, client: TestClient) -> None:
    (folder / "report").mkdir()
    (folder / "report" / "report.html").write_text("", encoding="utf-8")
    record = {"verdict": "explained", "held_out_runs": "not confirmed", "runs": []}
    (folder / "report" / "report.json").write_text(json.dumps(record), encoding="utf-8")
    page = client.get("/result").text
    assert "Verdict: explained, not confirmed" in page
    assert '<section class="answer fair">' in page
