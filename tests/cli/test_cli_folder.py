"""One result in a folder: the same work goes on, another is refused, overwriting takes smajax's own files and no others."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from smajax.cli.main import app
from smajax.cli.options import FITS
from smajax.cli.result_folder import LOCK, MARK, FolderTaken, claimed
from smajax.core.progress import quiet
from studies.source.row import Result, Row
from studies.source.write import MARK as FIGURES_MARK
from studies.source.write import draw, lying_in, write_pages
from tests.helpers.small_bench import bench, log, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")

run = CliRunner()


def _done(out: Path, command: str = "simulate", asked: object = 1) -> None:
    with claimed(out, command, {"asked": asked}, ["simulate.*"]):
        (out / "simulate.csv").write_text(str(asked))


def test_the_same_command_resumes_in_its_folder_and_another_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    _done(out)
    _done(out)
    with pytest.raises(FolderTaken, match=r"another result of `smajax simulate` \(asked: 1 there, 2 requested\)"):
        _done(out, asked=2)
    with pytest.raises(FolderTaken, match="a result of `smajax simulate`: give the name of another folder"):
        _done(out, "sweep")
    assert (out / "simulate.csv").read_text() == "1"


def test_a_refusal_lists_what_differs_in_short(tmp_path: Path) -> None:
    before = {"gone": 1, "experiment file": {f"key{k}": k for k in range(9)}}
    with claimed(tmp_path, "identify", before, []):
        pass
    asked = {"new": [0] * 99, "experiment file": {f"key{k}": k + (k > 3) for k in range(9)}}
    with pytest.raises(FolderTaken) as refused, claimed(tmp_path, "identify", asked, []):
        pass
    said = str(refused.value)
    assert "(changed in the experiment file, key4: 4 there, 5 requested; " in said
    assert said.endswith("and 3 more): give the name of another folder, or --overwrite to delete that.")
    del asked["experiment file"]
    words = r"gone: 1 there, not requested; new: not there, \[0, 0.*\.\.\. requested"
    with pytest.raises(FolderTaken, match=words), claimed(tmp_path, "identify", asked, []):
        pass


def test_overwriting_leaves_files_of_the_user(tmp_path: Path) -> None:
    out = tmp_path / "out"
    _done(out)
    (out / "thesis.tex").write_text("mine")
    with claimed(out, "sweep", {}, ["index.html"], overwrite=True):
        assert sorted(one.name for one in out.iterdir()) == [MARK, LOCK, "thesis.tex"]


def test_a_file_of_the_users_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("mine")
    ended = run.invoke(app, ["figures", "M9", "--out", str(tmp_path)])
    assert isinstance(ended.exception, FolderTaken)
    assert "would write over (README.md)" in str(ended.exception)
    assert [one.name for one in tmp_path.iterdir()] == ["README.md"]


@pytest.mark.parametrize(
    ("command", "own"),
    [("close-loop", "report.html"), ("check", "check.html"), ("identify", "identify.html"), ("sweep", "sweep.json")],
)
def test_a_users_file_that_is_named_like_a_result_is_refused(tmp_path: Path, command: str, own: str) -> None:
    (tmp_path / own).write_text("mine")
    with pytest.raises(FolderTaken, match=f"would write over \\({own}\\)"), claimed(tmp_path, command, {}, [own]):
        pass
    assert (tmp_path / own).read_text() == "mine"


@pytest.mark.parametrize("marked", [FITS, "fits"])  # as this version writes its mark, and as those before did
def test_overwriting_leaves_a_users_file_among_the_fits(tmp_path: Path, marked: str) -> None:
    with claimed(tmp_path, "identify", {}, [marked]):
        (tmp_path / "fits").mkdir()
        (tmp_path / "fits" / f"{'0f' * 16}.npz").write_text("a fit")
        (tmp_path / "fits" / "mine.npz").write_text("mine")
    with claimed(tmp_path, "simulate", {}, ["simulate.*"], overwrite=True):
        assert [one.name for one in (tmp_path / "fits").iterdir()] == ["mine.npz"]


def test_an_experiment_that_was_edited_and_other_data_are_refused(tmp_path: Path) -> None:
    def words(path: Path, *more: str) -> list[str | Path]:
        return ["identify", path, "--starts", "2", "--out", tmp_path / "out", *more]

    path = bench(tmp_path / "bench")
    assert smajax(*words(path)).code == 0
    fits = sorted((tmp_path / "out" / "fits").iterdir())
    path.write_text("# a remark\n" + path.read_text())
    assert smajax(*words(path)).code == 0  # the same experiment: its fits serve again
    assert sorted((tmp_path / "out" / "fits").iterdir()) == fits
    assert "--robust: False there, True requested" in smajax(*words(path, "--robust")).said
    page = (tmp_path / "out" / "identify.json").read_bytes()
    bench(tmp_path / "bench", ('start = "100', 'start = "90'))
    edited = smajax(*words(path))
    assert edited.code == 2
    assert "changed in the experiment file, unknown.convection_coefficient.start: '100 W/m^2/K' there" in edited.said
    assert "--overwrite" in edited.said
    bench(tmp_path / "bench")
    log(tmp_path / "bench" / "a.csv", top=4.9)
    other = smajax(*words(path))
    assert other.code == 2
    assert "changed in the data, A: " in other.said
    assert (tmp_path / "out" / "identify.json").read_bytes() == page


def _broken_off(out: Path, wrote: str, error: BaseException) -> None:
    with claimed(out, "sweep", {}, []):
        (out / "finished").mkdir()
        if wrote:
            (out / "finished" / wrote).write_text("half of the work")
        raise error


def test_work_that_fails_leaves_no_folder_behind(tmp_path: Path) -> None:
    deep, there = tmp_path / "a" / "b", tmp_path / "there"
    with pytest.raises(ValueError, match="no"):
        _broken_off(deep, "", ValueError("no"))
    assert not (tmp_path / "a").exists()
    there.mkdir()
    with pytest.raises(KeyboardInterrupt):
        _broken_off(there, "", KeyboardInterrupt())
    assert not (there / MARK).exists()
    with pytest.raises(KeyboardInterrupt):
        _broken_off(deep, "pid.npz", KeyboardInterrupt())
    assert (deep / "finished" / "pid.npz").exists()


@pytest.mark.parametrize(
    ("command", "file"), [("close-loop", "identify.html"), ("figures", "sweep.json"), ("identify", "report.html")]
)
def test_a_folder_without_a_mark_is_refused_if_it_holds_a_result(tmp_path: Path, command: str, file: str) -> None:
    (tmp_path / file).write_text("a result")
    with pytest.raises(FolderTaken, match=file), claimed(tmp_path, command, {}, []):
        pass
    assert not (tmp_path / MARK).exists()


def test_a_refused_command_ends_with_2_and_its_folder_is_gone(tmp_path: Path) -> None:
    for words in (["sweep", "--controllers", "pdi"], ["tune", "pdi"], ["figures", "M99"], ["identify", "no.toml"]):
        ended = run.invoke(app, [*words, "--out", str(tmp_path / "deep" / "out")])
        assert ended.exit_code in (1, 2)
        assert not (tmp_path / "deep").exists(), words


def _row(name: str) -> Row:
    return Row(
        name, "Fig. 1", "a system", "a claim", lambda fast: Result(True, "<found>", {"a": 1.0}, lambda figure: None)
    )


def test_a_figure_beside_others_stays_on_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("studies.source.write.every_row", lambda: [_row("M1"), _row("M9"), _row("M14")])
    (tmp_path / "mine.png").write_text("not a figure of the source")
    for name in ("M14", "M9"):
        assert [one.row.name for one in draw([_row(name)], tmp_path, True, quiet)] == [name]
        page = write_pages(tmp_path).read_text(encoding="utf-8")
    assert [one.row.name for one in lying_in(tmp_path)] == ["M9", "M14"]
    assert page.count('src="data:image/png;base64,') == page.count('srcset="data:image/png;base64,') == 2
    assert (tmp_path / "figures.csv").read_text().splitlines()[1:] == ["M9,holds,a,1", "M14,holds,a,1"]
    assert "2 of 2 hold, 0 hold in part, 0 fail." in page
    assert "&lt;found&gt;" in page
    assert "<found>" not in page
    (tmp_path / FIGURES_MARK).write_text("fast another version")
    draw((), tmp_path, True, quiet)
    assert lying_in(tmp_path) == []
    assert (tmp_path / "mine.png").exists()


def test_every_command_has_an_example_and_a_json_output(tmp_path: Path) -> None:
    told = run.invoke(app, ["--help"])
    assert "Exit codes: 0 success" in told.output
    commands = [one.name or one.callback.__name__.replace("_", "-") for one in app.registered_commands if one.callback]
    assert {"simulate", "doctor", "bench", "new-experiment", "close-loop"} <= set(commands)
    for name in commands:
        said = run.invoke(app, [name, "--help"])
        assert said.exit_code == 0
        assert f"Example:  smajax {name}" in said.output.replace("\n", " ").replace("   ", "  "), name
        if name != "app":  # whose result is a page
            assert "--json" in said.output, name
    assert "laws" in json.loads(run.invoke(app, ["presets", "--json"]).stdout)
