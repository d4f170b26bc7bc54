"""Measured files of each kind, and what is said about each mistake."""

from __future__ import annotations

import struct
import sys
import tracemalloc
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import xarray as xr

from smajax.data.experiment.column_guess import columns_of
from smajax.data.readers import headers
from smajax.data.readers.duplicate_times import once
from smajax.data.readers.optional_packages import needed
from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError, check_time


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


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
def test_text_tables_of_any_separator(tmp_path: Path, text: str) -> None:
    table = read_table(written(tmp_path / "run.csv", text))
    assert list(table.columns) == ["time", "pos"]
    np.testing.assert_array_equal(table.column("pos"), [1.5, 2.5])
    np.testing.assert_array_equal(table.column(1), [0.0, 1.0])
    assert table.clock("pos") is None


def test_a_text_table_without_header_has_numbered_columns(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.txt", "0\t1.5\n1\t2.5\n"))
    np.testing.assert_array_equal(table.column(2), [1.5, 2.5])


@pytest.mark.parametrize("suffix", [".dat", ".log", ".tab", ".ASC"])
def test_instruments_have_their_own_endings_for_text_tables(tmp_path: Path, suffix: str) -> None:
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
def test_a_text_table_with_a_mistake(tmp_path: Path, text: str, words: str) -> None:
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
def test_a_cell_that_is_no_number(tmp_path: Path, cell: str, words: str) -> None:
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


def test_a_line_that_is_like_units_and_is_none_is_named(tmp_path: Path) -> None:
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


def test_headings_of_tab_separated_decimal_commas_may_hold_blanks(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.txt", "t [s]\tU [V]\n0,0\t1,5\n0,1\t2,5\n"))
    np.testing.assert_array_equal(table.column("U [V]"), [1.5, 2.5])


def test_units_of_headings() -> None:
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
def test_units_behind_words_and_in_braces(heading: str, unit: str, name: str) -> None:
    assert (headers.unit_in(heading), headers.bare(heading)) == (unit, name)


def test_lines_above_a_table_without_a_line_of_names_are_no_preamble(tmp_path: Path) -> None:
    with pytest.raises(MeasuredDataError, match="the header has 1 cell"):
        read_table(written(tmp_path / "run.csv", "Logger 5\n0,1.5\n1,2.5\n"))


def test_samples_are_placed_by_the_lines_of_their_file(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.csv", "# made by hand\n\ntime,x\n0,1\n\n1,2\n"))
    assert [table.place(0), table.place(1)] == ["line 4", "line 6"]
    scipy.io.savemat(tmp_path / "run.mat", {"x": np.arange(3.0)})
    assert read_table(tmp_path / "run.mat").place(1) == "sample 2"


def test_files_that_are_missing_or_of_another_kind(tmp_path: Path) -> None:
    written(tmp_path / "Step01.csv", "0,1\n")
    with pytest.raises(MeasuredDataError, match=r"no such file; did you mean 'Step01.csv'"):
        read_table(tmp_path / "Step1.csv")
    with pytest.raises(MeasuredDataError, match="does not exist"):
        read_table(tmp_path / "nowhere" / "Step1.csv")
    with pytest.raises(MeasuredDataError, match=r"files ending in '\.xlsx' cannot be read; expected \.csv"):
        read_table(tmp_path / "a.xlsx")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(MeasuredDataError, match="is a folder"):
        read_table(tmp_path / "folder.csv")


def test_files_that_are_not_what_their_suffix_says(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "good.mat", {"x": np.arange(4.0)})
    content = (tmp_path / "good.mat").read_bytes()
    (tmp_path / "renamed.csv").write_bytes(content)
    with pytest.raises(MeasuredDataError, match="is a MATLAB file"):
        read_table(tmp_path / "renamed.csv")
    (tmp_path / "picture.txt").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    with pytest.raises(MeasuredDataError, match="binary data"):
        read_table(tmp_path / "picture.txt")
    with pytest.raises(MeasuredDataError, match="is not the MATLAB version 5 file"):
        read_table(written(tmp_path / "text.mat", "time,x\n0,1\n"))
    (tmp_path / "cut.mat").write_bytes(content[:150])
    with pytest.raises(MeasuredDataError, match="damaged or cut short"):
        read_table(tmp_path / "cut.mat")
    (tmp_path / "new.mat").write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    with pytest.raises(MeasuredDataError, match=r"MATLAB 7\.3 file is damaged|smajax\[formats\]', or save it again"):
        read_table(tmp_path / "new.mat")


def element(kind: int, content: bytes) -> bytes:
    """One element of a MATLAB 5 file."""
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def matlab_array(kind: int, dimensions: Sequence[int], name: bytes, content: bytes) -> bytes:
    flags, sizes = struct.pack("<II", kind, 0), struct.pack(f"<{len(dimensions)}i", *dimensions)
    return element(14, element(6, flags) + element(5, sizes) + element(1, name) + content)


def matlab_file(path: Path, *arrays: bytes) -> Path:
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM" + b"".join(arrays))
    return path


READINGS = matlab_array(6, (3, 1), b"x", element(9, np.arange(3.0).tobytes()))


def test_an_object_of_matlabs_own_is_left_unread_however_deep(tmp_path: Path) -> None:
    """scipy's reader ends the program in one like this: it follows the cells by calling itself."""
    layers = b""
    for _ in range(20_000):
        layers = matlab_array(1, (1, 1), b"", layers)
    held = element(14, element(6, struct.pack("<II", 17, 0)) + element(1, b"table") + element(1, b"MCOS") + layers)
    table = read_table(matlab_file(tmp_path / "run.mat", READINGS, held))
    np.testing.assert_array_equal(table.columns["x"], np.arange(3.0))
    assert "'table' is or holds an object of MATLAB's" in table.unusable["table"]
    with pytest.raises(MeasuredDataError, match="more than 100 deep"):
        read_table(matlab_file(tmp_path / "deep.mat", READINGS, layers))


@pytest.mark.parametrize("dimensions", [(2**31 - 1, 1), (2**31 - 1, 2**31 - 1), (2**16,) * 4])
def test_structs_without_fields_are_not_given_the_memory_that_they_announce(
    tmp_path: Path, dimensions: tuple[int, ...]
) -> None:
    empty = matlab_array(2, dimensions, b"s", element(5, struct.pack("<i", 1)) + element(1, b""))
    path = matlab_file(tmp_path / "run.mat", READINGS, empty)
    tracemalloc.start()
    with pytest.raises(MeasuredDataError, match=r"damaged.*0 bytes of names of fields"):
        read_table(path)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 2**24


def test_simulink_structures_carry_their_own_time(tmp_path: Path) -> None:
    time = np.array([[0.0], [0.1], [0.2]])
    signals = {"values": np.array([[1.0], [2.0], [3.0]]), "dimensions": 1.0, "label": "duty"}
    pair = {"time": time, "signals": {"values": np.array([[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]])}}
    scipy.io.savemat(
        tmp_path / "run.mat",
        {"Duty": {"time": time, "signals": signals, "blockName": "model/Duty"}, "Pair": pair, "gain": [1.0, 2.0]},
    )
    table = read_table(tmp_path / "run.mat")
    np.testing.assert_array_equal(table.column("Duty"), [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(table.clock("Duty"), [0.0, 0.1, 0.2])
    np.testing.assert_array_equal(table.column("Pair[2]"), [4.0, 5.0, 6.0])
    np.testing.assert_array_equal(table.column("gain"), [1.0, 2.0])
    assert table.clock("gain") is None


def _scope(folder: Path, version: str) -> Path:
    """What a Scope with three axes and a struct of logged signals leave in a workspace, saved as MATLAB 5 or 7.3."""
    path, time = folder / "run.mat", np.arange(40.0).reshape(-1, 1) / 10.0
    shown = [
        ("", "Voltage [V]", 5.0 * (time > 1.0)),
        ("Weg/mm", "", np.sin(time)),
        ("", "", np.hstack([time, 2.0 * time])),
    ]
    if version == "5":
        signals = np.zeros((1, 3), dtype=[("values", object), ("label", object), ("title", object)])
        for k, (label, title, values) in enumerate(shown):
            signals[0, k] = (values, label, title)
        logged = {
            "force": {"time": time, "values": 3.0 * time},
            "T": {"Time": time, "Data": 20.0 + time},
            "name": "logsout",
        }
        scipy.io.savemat(path, {"ScopeData": {"time": time, "signals": signals}, "logsout": logged})
        return path
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        scope = file.create_group("ScopeData")
        scope["time"] = time.T
        held = scope.create_group("signals")
        for key, place in (("label", 0), ("title", 1), ("values", 2)):
            references = []
            for k, one in enumerate(shown):
                text = isinstance(one[place], str)
                codes = np.array([[ord(letter)] for letter in str(one[place]) or "\0"], dtype=np.uint16)
                node = file.create_dataset(f"#refs#/{key}{k}", data=codes if text else np.asarray(one[place]).T)
                node.attrs["MATLAB_class"] = np.bytes_(b"char" if text else b"double")
                references.append([node.ref])
            held.create_dataset(key, data=np.array(references, dtype=object), dtype=h5py.ref_dtype)
        for name, words, values in (("force", ("time", "values"), 3.0 * time), ("T", ("Time", "Data"), 20.0 + time)):
            one = file.create_group(f"logsout/{name}")
            one[words[0]], one[words[1]] = time.T, values.T
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    return path


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_signals_of_a_scope_go_by_their_labels_and_logged_ones_by_their_fields(tmp_path: Path, version: str) -> None:
    table = read_table(_scope(tmp_path, version))
    assert sorted(table.columns) == [
        *("ScopeData.1", "ScopeData.2", "ScopeData.3[1]", "ScopeData.3[2]"),
        *("logsout.T", "logsout.force"),
    ]
    assert table.labels == {"ScopeData.1": "Voltage [V]", "ScopeData.2": "Weg/mm"}
    np.testing.assert_array_equal(table.column("ScopeData.3[2]"), 2.0 * (np.arange(40.0) / 10.0))
    np.testing.assert_array_equal(table.column("logsout.force"), 3.0 * (np.arange(40.0) / 10.0))
    np.testing.assert_array_equal(table.clock("logsout.T"), np.arange(40.0) / 10.0)
    guessed = {one.quantity: (one.key, one.unit, one.why) for one in columns_of(table)}
    assert guessed["voltage"] == ("ScopeData.1", "V", "its label 'Voltage [V]' and unit")
    assert guessed["position"] == ("ScopeData.2", "mm", "its label 'Weg/mm' and unit")
    assert guessed["force"][0] == "logsout.force"


def test_mat_variables_of_another_structure_or_missing(tmp_path: Path) -> None:
    scipy.io.savemat(
        tmp_path / "run.mat",
        {
            "Other": {"t": [0.0, 1.0], "y": [1.0, 2.0]},
            "Short": {"time": [0.0, 1.0], "signals": {"values": [1.0, 2.0, 3.0]}},
            "text": "words",
            "x": np.arange(3.0),
        },
    )
    table = read_table(tmp_path / "run.mat")
    for name, words in {
        "Other": r"struct with fields \['t', 'y'\]; expected 'time' and 'signals.values'",
        "Short": "2 times and 3 values",
        "text": "expected real numbers",
        "othr": r"no column 'othr'; did you mean 'Other'\? It has: x, Other, Short, text",
    }.items():
        with pytest.raises(MeasuredDataError, match=words):
            table.column(name)
    scipy.io.savemat(tmp_path / "none.mat", {"text": "words"})
    with pytest.raises(MeasuredDataError, match="no signal in it"):
        read_table(tmp_path / "none.mat")


def test_time_must_increase() -> None:
    check_time(np.array([0.0, 1.0, 5.0]), "here")
    with pytest.raises(
        MeasuredDataError, match=r"here does not increase at sample 3 \(1 ms then 1 ms\) and at 1 other"
    ):
        check_time(np.array([0.0, 1.0, 1.0, 0.5]), "here", "ms")
    with pytest.raises(MeasuredDataError, match="expected at least two"):
        check_time(np.array([0.0]), "here")
    with pytest.raises(MeasuredDataError, match="here is nan in line 9"):
        check_time(np.array([0.0, np.nan]), "here", place=lambda _: "line 9")


@pytest.mark.parametrize(
    "text",
    [
        "time;x\n0,0;1,5\n0,25;-2,5e1\n",
        "0,0 1,5\n0,25 -2,5e1\n",
        'time,x\n"0,0","1,5"\n"0,25","-2,5e1"\n',
        "time\tx\n0\t1,500\n0,25\t-25\n",
    ],
)
def test_decimal_commas(tmp_path: Path, text: str) -> None:
    table = read_table(written(tmp_path / "run.csv", text))
    np.testing.assert_array_equal(table.column(1), [0.0, 0.25])
    np.testing.assert_array_equal(table.column(2), [1.5, -25.0])


@pytest.mark.parametrize(
    "text", ["a x\n1,500 2,000\n2,250 3,125", 'a,x\n"1,500","2,000"\n"2,250","3,125"', "a;x\n1,500;2,000\n2,250;3,125"]
)
def test_decimal_commas_that_are_said_to_be_some(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    table = read_table(tmp_path / "a.csv", decimal=",")
    np.testing.assert_array_equal(table.column("a"), [1.5, 2.25])
    np.testing.assert_array_equal(table.column("x"), [2.0, 3.125])


def test_one_column_of_decimal_commas(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("my x\n1,500\n2,250\n")
    np.testing.assert_array_equal(read_table(tmp_path / "a.csv", decimal=",").column("my x"), [1.5, 2.25])


@pytest.mark.parametrize(
    ("text", "decimal", "words"),
    [
        ("a,x\n1,500\n2,250", ",", r"commas separate its cells \('a,x'\), and \[data\] decimal = ',' says"),
        ("a;x\n1,500;1.5\n2,250;2.5", ",", r"line 2 has '1\.5', and \[data\] decimal = ','"),
        ("a;x\n1,5;1\n2,25;2", ".", "line 2, column 'a': '1,5' is not a number"),
    ],
)
def test_a_decimal_mark_that_the_file_contradicts(tmp_path: Path, text: str, decimal: str, words: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(MeasuredDataError, match=words):
        read_table(tmp_path / "a.csv", decimal=decimal).column("a")


def test_commas_that_may_be_thousands_are_not_guessed(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.csv", "time;x\n0;1,500\n1;2,500\n"))
    with pytest.raises(MeasuredDataError, match="set thousands apart"):
        table.column("x")
    points = read_table(written(tmp_path / "points.csv", "time;x;y\n0;1.5;1,5\n1;2.5;2,25\n"))
    with pytest.raises(MeasuredDataError, match="write a decimal point"):
        points.column("y")


def test_matlab_7_3_files_are_read_as_those_of_version_5(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.mat", "w", userblock_size=512) as file:
        duty = file.create_group("Duty")
        duty["time"] = np.array([[0.0, 0.1, 0.2]])
        duty.create_group("signals")["values"] = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
        file["gain"] = np.array([[1.0], [2.0]])
        file["text"] = np.array([[77], [78]], dtype=np.uint16)
        file["text"].attrs["MATLAB_class"] = np.bytes_(b"char")
        file.create_group("Other")["y"] = np.array([[1.0]])
    with (tmp_path / "run.mat").open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    table = read_table(tmp_path / "run.mat")
    np.testing.assert_array_equal(table.column("Duty[2]"), [4.0, 5.0, 6.0])
    np.testing.assert_array_equal(table.clock("Duty[1]"), [0.0, 0.1, 0.2])
    np.testing.assert_array_equal(table.column("gain"), [1.0, 2.0])
    with pytest.raises(MeasuredDataError, match="no real numbers"):
        table.column("text")
    with pytest.raises(MeasuredDataError, match=r"expected 'time' and 'signals.values'"):
        table.column("Other")


def test_parquet_files(tmp_path: Path) -> None:
    parquet, arrow = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("pyarrow")
    when = np.array(["2024-05-01T10:00:00.000", "2024-05-01T10:00:00.250"], "datetime64[ms]")
    parquet.write_table(arrow.table({"when": when, "x": [1, None], "say": ["a", "b"]}), tmp_path / "run.parquet")
    table = read_table(tmp_path / "run.parquet")
    np.testing.assert_array_equal(table.column("when"), [0.0, 0.25])
    np.testing.assert_array_equal(table.column("x", gaps=True), [1.0, np.nan])
    with pytest.raises(MeasuredDataError, match="expected numbers"):
        table.column("say")
    with pytest.raises(MeasuredDataError, match="no Parquet file"):
        read_table(written(tmp_path / "no.parquet", "x"))


def test_netcdf_files(tmp_path: Path) -> None:
    held = xr.Dataset({"x": ("time", [1.0, 2.0]), "wide": (("time", "k"), np.zeros((2, 3)))}, {"time": [0.0, 0.5]})
    held.to_netcdf(tmp_path / "run.nc", engine="scipy")
    table = read_table(tmp_path / "run.nc")
    np.testing.assert_array_equal(table.column("time"), [0.0, 0.5])
    np.testing.assert_array_equal(table.column("x"), [1.0, 2.0])
    with pytest.raises(MeasuredDataError, match="no NetCDF file"):
        read_table(written(tmp_path / "no.nc", "x"))


def test_netcdf_4_files_are_read_as_those_of_version_3(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("h5netcdf")
    when = np.array(["2024-05-01T10:00:00", "2024-05-01T10:00:02"], "datetime64[ns]")
    held = xr.Dataset(
        {
            "x": ("time", [1.0, np.nan], {"units": "mm"}),
            "count": ("time", np.array([3, 4], np.int16)),
            "label": ("time", ["idle", "hot"]),
            "wide": (("time", "k"), np.zeros((2, 3))),
        },
        {"time": when},
    )
    held.to_netcdf(tmp_path / "run.nc", engine="h5netcdf", unlimited_dims=["time"])
    assert (tmp_path / "run.nc").read_bytes().startswith(b"\x89HDF")
    table = read_table(tmp_path / "run.nc")
    assert set(table.columns) == {"time", "x", "count"}
    np.testing.assert_array_equal(table.column("time"), [0.0, 2.0])
    np.testing.assert_array_equal(table.column("x", gaps=True), [1.0, np.nan])
    np.testing.assert_array_equal(table.column("count"), [3.0, 4.0])
    assert table.units == {"time": "s", "x": "mm"}
    with pytest.raises(MeasuredDataError, match="expected numbers"):
        table.column("label")
    (tmp_path / "cut.nc").write_bytes((tmp_path / "run.nc").read_bytes()[:600])
    with pytest.raises(MeasuredDataError, match=r"cut\.nc: is no NetCDF file, or a damaged one"):
        read_table(tmp_path / "cut.nc")
    monkeypatch.setitem(sys.modules, "h5netcdf", None)  # as where the extra is not installed
    with pytest.raises(MeasuredDataError, match=r"run\.nc: .* needs h5netcdf: pip install 'smajax\[formats\]'"):
        read_table(tmp_path / "run.nc")


def test_a_library_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(MeasuredDataError, match=r"needs no_such_library: pip install 'smajax\[formats\]', or else"):
        needed("no_such_library", tmp_path / "run.mat", "or else")


def test_samples_at_the_same_time() -> None:
    time, values = np.array([0.0, 1.0, 1.0, 2.0, 2.0]), np.array([5.0, 6.0, 6.0, 7.0, 9.0])
    found = {how: once(time, values, how) for how in ("refuse", "mean", "last")}
    np.testing.assert_array_equal(found["refuse"][0], [0.0, 1.0, 2.0, 2.0])  # those that differ are left to be refused
    np.testing.assert_array_equal(found["mean"][1], [5.0, 6.0, 8.0])
    np.testing.assert_array_equal(found["last"][1], [5.0, 6.0, 9.0])
    assert [one[2] for one in found.values()] == [1, 2, 2]
