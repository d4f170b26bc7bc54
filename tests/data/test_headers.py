"""Names and units in the headings of columns."""

from __future__ import annotations

import pytest

from smajax.data.readers import headers


def test_units_are_read_from_headings() -> None:
    found = {
        name: headers.unit_in(name)
        for name in ("Zeit/s", "U / mV", "s/mm", "T/°C", "x [mm]", "t_ms", "a/b", "/s", "h [W/(m^2 K)]", "x")
    }
    assert list(found.values()) == ["s", "mV", "mm", "°C", "mm", "ms", "", "", "W/(m^2 K)", ""]
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
