"""Text tables: separators, headers, lines of units, clock times, and what is said about each mistake."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError
from tests.helpers.text_files import written


@pytest.mark.parametrize(
    "text",
    [
        "time,pos\n0,1.5\n1,2.5\n",
        "time\tpos\n0\t1.5\n1\t2.5\n",
        "time;pos\n0;1.5\n1;2.5\n",
        "time pos\r\n 0   1.5\r\n 1   2.5\r\n\r\n",
        '# a comment\n"time", "pos"\n0, 1.5\n\n1, 2.5e0\n',
        "\ufefftime,pos\n0,1.5\n1,2.5",
        "time|pos\n0|1.5\n1|2.5\n",
        "Logger 5\nSerial,123,B\n\ntime,pos\n0,1.5\n1,2.5\n",
        "Logger\tA\tB\nmade on a bench\ntime\tpos\n0\t1.5\n1\t2.5\n",
    ],
)
def test_text_tables_are_read_with_any_separator(tmp_path: Path, text: str) -> None:
    table = read_table(written(tmp_path / "run.csv", text))
    assert list(table.columns) == ["time", "pos"]
    np.testing.assert_array_equal(table.column("pos"), [1.5, 2.5])
    np.testing.assert_array_equal(table.column(1), [0.0, 1.0])
    assert table.clock("pos") is None


def test_a_text_table_without_header_has_numbered_columns(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.txt", "0\t1.5\n1\t2.5\n"))
    np.testing.assert_array_equal(table.column(2), [1.5, 2.5])


@pytest.mark.parametrize("suffix", [".dat", ".log", ".tab", ".ASC"])
def test_text_tables_are_read_under_the_suffixes_of_instruments(tmp_path: Path, suffix: str) -> None:
    table = read_table(written(tmp_path / f"run{suffix}", "time [s];force [N]\n0;1,5\n0,1;2,5\n"), ["force [N]"])
    np.testing.assert_array_equal(table.column("force [N]"), [1.5, 2.5])
    assert list(table.columns) == ["force [N]"]
    (tmp_path / f"other{suffix}").write_bytes(b"MDF \0\0\1\2")
    with pytest.raises(MeasuredDataError, match="binary data"):
        read_table(tmp_path / f"other{suffix}")


def test_a_header_may_hold_another_encoding_and_commas(tmp_path: Path) -> None:
    path = tmp_path / "run.txt"
    path.write_bytes("T(°C),in strain\n20 0.1\n30 0.2\n".encode("latin-1"))
    np.testing.assert_array_equal(read_table(path).column(2), [0.1, 0.2])


def test_a_column_of_text_is_an_error_only_when_asked_for(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.csv", "time,label,x\n0,idle,1\n1,hot,2\n"))
    np.testing.assert_array_equal(table.column("x"), [1.0, 2.0])
    with pytest.raises(MeasuredDataError, match=r"run\.csv: line 2, column 'label': 'idle' is not a number"):
        table.column("label")


def test_a_missing_column_lists_those_there_are(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.csv", "Time,Strain\n0,1\n1,2\n"))
    with pytest.raises(MeasuredDataError, match=r"no column 'strian'; did you mean 'Strain'\? It has: Time, Strain$"):
        table.column("strian")
    with pytest.raises(MeasuredDataError, match="no column number 3; it has columns 1 to 2"):
        table.column(3)
    with pytest.raises(MeasuredDataError, match=r"no column 'strian'; it has: Time, Strain$"):
        table.column("strian", taken=["Strain"])
    with pytest.raises(MeasuredDataError, match=r"no column 'strian'; it has: Time, Strain$"):
        table.column("strian", taken=[2])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the file is empty"),
        ("\n\n", "holds no data line"),
        ("time,x\n", "a header and no data line"),
        (
            "time,x\n0,1\n1,2,3\n",
            "line 3 has 3 cells, expected 2 as in the other lines; complete the line or delete it",
        ),
        ("time,x,y\n0,1\n", "the header has 3 cells"),
        ("time,x\n0,1,2\n1,2\n", "line 2 has 3 cells, expected 2"),
        ("Time [ms];U [mV];Displ [mm]\n0;1;2\n10;1;2\n20;1;2\n30\n", "line 5 has 1 cell, expected 3"),
        ("T,in x\n0 1\n10 1\n20,\n", "line 4 has 1 cell, expected 2"),
        ("x,x\n0,1\n", "given more than once"),
    ],
)
def test_a_mistake_in_a_text_table_is_named_with_its_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(MeasuredDataError, match=words):
        read_table(written(tmp_path / "run.csv", text))


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        ("oops", "line 3, column 'x': 'oops' is not a number"),
        ("", "line 3, column 'x': the cell is empty"),
        ("1,500", "may be decimal or set thousands apart: write a decimal point"),
        ("nan", "not finite, the first is nan in line 3"),
        ("-inf", "not finite, the first is -inf in line 3"),
    ],
)
def test_a_cell_that_is_no_number_is_named(tmp_path: Path, cell: str, words: str) -> None:
    table = read_table(written(tmp_path / "run.csv", f"time;x\n0;1\n1;{cell}\n2;1\n"))
    with pytest.raises(MeasuredDataError, match=words):
        table.column("x")


@pytest.mark.parametrize(
    ("units", "known"),
    [
        ("s;V", {"time": "s", "x": "V"}),
        ("[s];[V]", {"time": "s", "x": "V"}),
        ("s;-", {"time": "s", "x": "-"}),
        ("s;1", {"time": "s", "x": "1"}),
        ("ms;", {"time": "ms"}),
    ],
)
def test_a_line_of_units_is_read(tmp_path: Path, units: str, known: dict[str, str]) -> None:
    table = read_table(written(tmp_path / "run.csv", f"time;x\n{units}\n0;1\n1;2\n"))
    assert table.units == known
    np.testing.assert_array_equal(table.column("time"), [0.0, 1.0])
    assert table.place(0) == "line 3"


def test_a_second_line_that_only_looks_like_units_is_named(tmp_path: Path) -> None:
    path = written(tmp_path / "run.csv", "time;x\nsecs_;V\n0;1\n1;2\n")
    with pytest.raises(
        MeasuredDataError, match=r"line 2, column 'time': .* is not a number; line 2 looks like units: del"
    ):
        read_table(path).column("time")


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [
        (["2026-11-12 10:00:00.100", "2026-11-12 10:00:00.350", "2026-11-13 10:00:00.100"], [0.0, 0.25, 86400.0]),
        (["2026-11-12T23:59:59Z", "2026-11-13T01:00:00+01:00", "2026-11-12T22:00:01-02:00"], [0.0, 1.0, 2.0]),
        (["10:00:00,100", "10:00:00,350", "10:00:01"], [0.0, 0.25, 0.9]),
        (["23:59:59.5", "0:00:00.0", "00:00:01.5"], [0.0, 0.5, 2.0]),  # past midnight
    ],
)
@pytest.mark.parametrize("head", ["Uhrzeit;U;x\n", ""])
def test_clock_times_are_seconds_from_the_first(
    tmp_path: Path, head: str, cells: list[str], seconds: list[float]
) -> None:
    text = head + "".join(f"{cell};0,5;1\n" for cell in cells)
    table = read_table(written(tmp_path / "run.csv", text))
    time = table.order[0]
    np.testing.assert_array_equal(table.column(time), seconds)
    np.testing.assert_array_equal(table.column(2), [0.5, 0.5, 0.5])
    assert table.units[time] == "s"


@pytest.mark.parametrize("cell", ["2026-13-12 10:00:00", "10:61:00", "10:00", "Ende", "5"])
def test_a_cell_that_is_no_clock_time_is_named(tmp_path: Path, cell: str) -> None:
    table = read_table(written(tmp_path / "run.csv", f"t;x\n10:00:00;1\n10:00:01;2\n{cell};3\n"))
    with pytest.raises(MeasuredDataError, match=rf"line 4, column 't': '{cell}' is not a clock time"):
        table.column("t")


def test_a_preamble_above_a_table_without_names_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(MeasuredDataError, match="the header has 1 cell"):
        read_table(written(tmp_path / "run.csv", "Logger 5\n0,1.5\n1,2.5\n"))
