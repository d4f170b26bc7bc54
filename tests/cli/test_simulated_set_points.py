"""Set points of `smajax simulate`: levels, rows of a file, what is said of their figures of merit and of a run that ends before them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.control.figures_of_merit import band_of
from smajax.control.loop_around import loop_around
from smajax.control.loop_dataset import simulate_loop_dataset
from smajax.control.reference_file import read_reference
from smajax.control.run_notes import StraightLines
from smajax.control.run_request import LoopRequest, RunRequest, run_closed, run_open
from smajax.control.run_result import RunResult
from smajax.core.units import UnitError
from smajax.data.text_input import given
from smajax.model.presets import build
from smajax.report.note_words import note_sentences
from smajax.report.simulate_page import write_run
from smajax.report.simulate_words import answer, merit_rows, merit_rule, set_point_rows

pytestmark = pytest.mark.usefixtures("blank_pictures")

HANGING = ("flexinol_table_3_2", "dead_weight", "flexinol_voltage")


def test_a_reference_from_a_file_is_the_same_on_a_terminal_and_in_python(tmp_path: Path) -> None:
    """A sine was a staircase on a terminal, and straight lines in Python."""
    path = tmp_path / "sine.csv"
    rows = "\n".join(f"{k / 50},{20.0 + 30.0 * np.sin(0.3 * np.pi * k / 50.0)}" for k in range(501))
    path.write_text(f"time_s,angle_deg\n{rows}\n")

    def followed(text: str, held: bool) -> RunResult:
        found = run_closed(RunRequest(dt=0.005), LoopRequest("sld", text))
        reference = read_reference(path, "time_s", "angle_deg", "deg", 0.005, held=held)
        np.testing.assert_allclose(found.data["wanted"], reference.position, rtol=0.0, atol=1e-12)
        plant = build("niti_table_3_1", "arm", "amplified_voltage")
        loop = loop_around(plant, "sld")
        again = simulate_loop_dataset(loop, reference, dt=0.005)
        np.testing.assert_allclose(found.data["position"], again["position"], rtol=0.0, atol=1e-4)
        np.testing.assert_array_equal(simulate_loop_dataset(loop, text, dt=0.005)["position"], again["position"])
        return found

    lines, stairs = (followed(f"{path}:angle_deg:deg{how}", bool(how)) for how in ("", ":held"))
    off = [float(np.sqrt(np.mean((one.data["position"] - one.data["wanted"])[1000:] ** 2))) for one in (lines, stairs)]
    assert off[0] < off[1], "the derivatives of the reference are lost"
    error = np.degrees(lines.data["position"] - lines.data["wanted"])
    for part, over in (("whole_run", slice(None)), ("second_half", slice(1000, None))):
        assert np.degrees(lines.tracking_error[part]) == pytest.approx(
            float(np.sqrt(np.mean(error[over] ** 2))), rel=1e-9
        )
    said = [["tracking error (RMS, whole run)", "deg"], ["tracking error (RMS, second half)", "deg"]]
    assert [[row[0], row[2]] for row in merit_rows(lines)] == said
    assert "follows the reference with an RMS tracking error of" in answer(lines)
    (note,) = note_sentences(lines.notes)
    assert f"{path}:angle_deg:deg:held" in note
    assert not any(isinstance(one, StraightLines) for one in stairs.notes)


def test_rows_of_a_file_that_are_held_have_figures_of_merit(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("time_s,angle_deg\n0,40\n3,10\n5,10\n")
    found, asked = (
        run_closed(RunRequest(), LoopRequest("pid", text))
        for text in (f"{tmp_path / 'points.csv'}:angle_deg:held", "40deg:3s,10deg:2s")
    )
    assert [one.begin for one in found.by_set_point] == [0.0, 3.0]
    assert not found.tracking_error
    np.testing.assert_array_equal(found.data["position"], asked.data["position"])


def test_the_rule_of_the_figures_of_merit_is_said(tmp_path: Path) -> None:
    """An angle that came into the band for good in the last fifth of its set point was said never to settle, by a rule that stood nowhere."""
    late = run_closed(RunRequest(), LoopRequest("pid", "40deg:2.2s,10deg:3s"))
    inside = np.abs(late.data["position"] - late.data["wanted"])[:440] <= np.radians(1.0)
    assert not np.isfinite(late.by_set_point[0].merit.settling_time)
    assert bool(inside[-1]), "the case is not the one of this test"
    assert set_point_rows(late)[1][0][4] == "not within 2.2 s"
    rule = merit_rule(late)
    assert "within ±1 deg" in rule
    assert "last 20% of the set point's time" in rule
    page = write_run(late, tmp_path, "a run", "smajax").read_text(encoding="utf-8")
    assert "last 20% of the set point&#x27;s time" in page
    hanging = run_closed(RunRequest(*HANGING), LoopRequest("pid", "5mm:2s"))
    assert f"within ±{1e3 * float(band_of(hanging.system)):.3g} mm" in merit_rule(hanging)


def test_a_run_that_ends_before_its_last_level_says_so() -> None:
    short = run_open(RunRequest(inputs={"voltage": "8V:10s"}, dt=3.0))
    assert float(short.data["time"][-1]) == 9.0
    assert any("ends at 9 s of 10 s" in one for one in note_sentences(short.notes))
    assert not any("ends at" in one for one in note_sentences(run_open(RunRequest(inputs={"voltage": "8V:1s"})).notes))
    loop = run_closed(RunRequest(), LoopRequest("pid", "40deg:1s", period=0.3))
    assert any("ends at 0.9 s of 1 s" in one for one in note_sentences(loop.notes))


def test_a_file_without_its_column_is_told_the_form(tmp_path: Path) -> None:
    (tmp_path / "sine.csv").write_text("time_s,angle_deg\n0,40\n3,10\n")
    with pytest.raises(UnitError, match=r"FILE:COLUMN:UNIT, such as sine\.csv:COLUMN:deg"):
        given(str(tmp_path / "sine.csv"), "rad", bare="deg")
