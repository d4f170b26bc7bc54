"""Names and units in the headings of columns."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.data.experiment.column_guess import columns_of
from smajax.data.readers import headers
from smajax.data.readers.read import read_table


def test_units_are_read_from_headings() -> None:
    found = {
        name: headers.unit_in(name)
        for name in ("Zeit/s", "U / mV", "s/mm", "T/°C", "x [mm]", "t_ms", "T_degF", "a/b", "/s", "h [W/(m^2 K)]", "x")
    }
    assert list(found.values()) == ["s", "mV", "mm", "°C", "mm", "ms", "degF", "", "", "W/(m^2 K)", ""]
    assert (headers.bare("Zeit/s"), headers.bare("a/b"), headers.words("U / mV")) == ("Zeit", "a/b", ["u"])


@pytest.mark.parametrize(
    ("heading", "unit", "name"),
    [
        ("Weg in µm", "µm", "Weg"),
        ("Zeit in s", "s", "Zeit"),
        ("Spannung, V", "V", "Spannung"),
        ("Time{s}", "s", "Time"),
        ("Pos um", "um", "Pos"),
        ("Phase A", "", "Phase A"),  # a name, it may be
        ("in s", "", "in s"),
        ("duty, -", "", "duty, -"),
    ],
)
def test_units_behind_words_and_in_braces_are_read(heading: str, unit: str, name: str) -> None:
    assert (headers.unit_in(heading), headers.bare(heading)) == (unit, name)


def test_a_letter_behind_the_name_of_a_temperature_is_its_unit(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(
        "T_F,time_s,T_amb_F,T_B,force_F\n72,0,72,22,1\n73,1,73,80,0\n74,2,74,81,1\n", encoding="utf-8"
    )
    found = {one.name: (one.quantity, one.unit) for one in columns_of(read_table(tmp_path / "log.csv"))}
    assert found == {
        "time_s": ("time", "s"),
        "T_amb_F": ("ambient_temperature", "degF"),
        "force_F": ("force", "N"),
        "T_F": ("temperature", "degC"),
        "T_B": ("", "degC"),  # the temperature is taken
    }
