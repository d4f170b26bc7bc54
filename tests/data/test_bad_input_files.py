"""Measured files and experiment files that cannot be used, each really given to `smajax close-loop`: one message, exit code 2."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError
from tests.helpers.small_bench import bench, log, refused


def _line(number: int, text: str) -> tuple[int, str]:
    return number, text


LINES = {
    "nan": (_line(11, "0.5,5,nan"), "column 'x' has 1 value(s) that are not finite, the first is nan in line 12"),
    "inf": (_line(11, "0.5,5,-inf"), "the first is -inf in line 12; remove or repair"),
    "beyond float64": (_line(11, "0.5,5,1e999"), "the first is inf in line 12"),
    "empty cell": (_line(11, "0.5,5,"), "line 12, column 'x': the cell is empty; expected a number in every line"),
    "text": (_line(11, "0.5,5,oops"), "line 12, column 'x': 'oops' is not a number; expected a number in every line"),
    "short line": (
        _line(11, "0.5,5"),
        "line 12 has 2 cells, expected 3 as in the other lines; complete the line or delete",
    ),
    "time backwards": (_line(11, "0.1,5,1"), "does not increase at line 12 (0.45 s then 0.1 s); sort the samples"),
    "another value at the same time": (_line(11, "0.45,5,99"), "or write repeated = 'mean' (or 'last') under [time]"),
}


@pytest.mark.parametrize("name", LINES)
def test_a_line_that_is_no_sample_is_named(tmp_path: Path, name: str) -> None:
    (number, text), words = LINES[name]
    experiment = bench(tmp_path / "bench")
    lines = (experiment.parent / "a.csv").read_text().splitlines()
    lines[number] = text
    (experiment.parent / "a.csv").write_text("\n".join(lines) + "\n")
    said = refused("close-loop", experiment, "--out", tmp_path / "out")
    assert said.startswith(f"Error: {experiment}: runs.A.file: {experiment.parent / 'a.csv'}: "), said
    assert words in said
    assert not (tmp_path / "out").exists()


CONTENTS = {
    "nothing": (b"", "the file is empty"),
    "blank lines": (b"\n\n \n", "holds no data line"),
    "a heading alone": (b"t,U,x\n", "holds a header and no data line"),
    "one sample": (b"t,U,x\n0,5,0\n", "1 sample(s); expected at least two"),
    "a zip": (b"PK\x03\x04\x14\0\0\0\x08\0", "is not the text that its suffix says (it holds binary data)"),
    "MATLAB 5": (
        b"MATLAB 5.0 MAT-file, Platform",
        "is a MATLAB file, not the text that its suffix says; rename it to .mat",
    ),
    "MATLAB 7.3": (b"\x89HDF\r\n\x1a\n", "is a MATLAB file, not the text that its suffix says"),
    "another heading": (b"time,U,x\n0,5,0\n1,5,0\n", "no column 't'; it has: time, U, x"),
    "a column less": (b"t,U\n0,5\n1,5\n", "no column 'x'; it has: t, U"),
    "one line without an end": (b"7" * (2 << 20), "line 1 is longer than 1,048,576 characters"),
    "a bare carriage return in a cell": (b't,U,x\n0,5,0\n1,5,"\r"\n', "expected 3"),
    "Latin-1 in a cell": ("t,U,x\n0,5,0\n1,5,ü\n".encode("latin-1"), "line 3, column 'x': 'ü' is not a number"),
    "Latin-1 in the heading": ("t,U,x,°C\n0,5,0,1\n".encode("latin-1"), "1 sample(s); expected at least two"),
}


@pytest.mark.parametrize("name", CONTENTS)
def test_a_log_of_another_kind_is_named(tmp_path: Path, name: str) -> None:
    content, words = CONTENTS[name]
    experiment = bench(tmp_path / "bench")
    (experiment.parent / "a.csv").write_bytes(content)
    said = refused("close-loop", experiment, "--out", tmp_path / "out")
    assert "runs.A.file: " in said
    assert words in said


@pytest.mark.parametrize(
    ("variables", "words"),
    [
        ({"x": np.zeros((2, 3, 4))}, "variable 'x' is an array of float64; expected real numbers"),
        ({"x": {"time": np.arange(3.0), "label": "stroke"}}, "expected 'time' and 'signals.values'"),
        ({"x": np.array([1j, 2j])}, "variable 'x' is an array of complex128; expected real numbers"),
        ({"x": "text"}, "expected real numbers"),
        ({"y": np.arange(3.0)}, "no column 'x'; it has: y"),
        (
            {"x": {"time": np.arange(2.0), "signals": {"values": np.arange(3.0)}}},
            "2 times and 3 values; expected as many",
        ),
        ({"x": np.arange(3.0)}, "carries no time; add [time] with column = '...', or kind = 'sample'"),
    ],
)
def test_a_mat_file_of_another_structure_is_named(tmp_path: Path, variables: dict[str, object], words: str) -> None:
    experiment = bench(
        tmp_path / "bench",
        ('[time]\ncolumn = "t"\nunit = "s"\n', ""),
        ('column = "U"\nunit = "V"', 'variable = "x"\nunit = "V"'),
        ('column = "x"\nunit = "mm"', 'variable = "x"\nunit = "mm"'),
        ('file = "a.csv"', 'file = "a.mat"'),
    )
    scipy.io.savemat(experiment.parent / "a.mat", variables)
    assert words in refused("close-loop", experiment, "--out", tmp_path / "out")


TOMLS = {
    "not UTF-8": (b'title = "B\xffench"\n', "is not UTF-8 text (invalid start byte at byte 10)"),
    "not TOML": (b"title = \n", "is not TOML: Invalid value (at line 1, column 9)"),
    "nested too deep": (b"title = " + b"[" * 100_000, "is not TOML: "),
    "a number too long": (b"title = " + b"9" * 10_000, "is not TOML: Exceeds the limit"),
    "the data": (b"t,U,x\n" * 200_000, "is larger than 1,048,576 bytes; expected an experiment file, not the data"),
    "nothing": (b"", "model: is missing; expected a section [model] with wire, load and drive"),
}


@pytest.mark.parametrize("name", TOMLS)
def test_a_file_that_is_no_experiment_is_named(tmp_path: Path, name: str) -> None:
    content, words = TOMLS[name]
    (tmp_path / "experiment.toml").write_bytes(content)
    said = refused("close-loop", tmp_path, "--out", tmp_path / "out")
    assert str(tmp_path / "experiment.toml") in said
    assert words in said
    assert len(said) < 1500


def test_a_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    experiment = bench(tmp_path / "bench", ('unit = "V"', 'unit = "Vlt"'))
    experiment.write_bytes(b"\xef\xbb\xbf" + experiment.read_bytes())
    assert "channels.voltage.unit: unit 'Vlt' is not known" in refused("close-loop", experiment)


def test_a_named_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "experiment.toml")
    assert "is no file; expected an experiment file" in refused("close-loop", tmp_path / "experiment.toml")
    experiment = bench(tmp_path / "bench")
    (experiment.parent / "a.csv").unlink()
    os.mkfifo(experiment.parent / "a.csv")
    assert "expected a file" in refused("close-loop", experiment)


@pytest.mark.parametrize("name", ["../outside.csv", "{outside}", "link.csv", "folder/outside.csv", "loop.csv"])
def test_nothing_outside_of_the_data_folder_is_read(tmp_path: Path, name: str) -> None:
    outside = log(tmp_path / "outside.csv")
    name = name.format(outside=outside)
    experiment = bench(tmp_path / "bench", ('file = "a.csv"', f'file = "{name}"'))
    (experiment.parent / "link.csv").symlink_to(outside)
    (experiment.parent / "folder").symlink_to(tmp_path)
    (experiment.parent / "loop.csv").symlink_to("loop.csv")
    said = refused("close-loop", experiment, "--out", tmp_path / "out")
    assert f"runs.A.file: got '{name}', which" in said


def test_a_folder_that_is_linked_to_is_named_under_data(tmp_path: Path) -> None:
    """A link to the whole folder of the data is what `[data] folder` names, so what lies behind it is inside."""
    experiment = bench(
        tmp_path / "bench", ("[[runs]]", '[data]\nfolder = "logs"\n[[runs]]'), ('file = "b.csv"', 'file = "c.csv"')
    )
    (tmp_path / "elsewhere").mkdir()
    log(tmp_path / "elsewhere" / "a.csv")
    (experiment.parent / "logs").symlink_to(tmp_path / "elsewhere")
    assert "c.csv: there is no such file; did you mean 'a.csv'?" in refused("close-loop", experiment)


def test_a_log_that_may_not_be_read_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(path: Path) -> None:
        raise PermissionError(13, "Permission denied", str(path))  # by hand: a superuser is denied nothing

    monkeypatch.setattr("smajax.data.readers.read.READERS", {".csv": denied})
    with pytest.raises(MeasuredDataError, match=r"a\.csv: may not be read; give yourself the right"):
        read_table(log(tmp_path / "a.csv"))


def test_a_late_mistake_of_a_long_log_is_named(tmp_path: Path) -> None:
    """Beyond the first block of lines, in the columns asked for; a mistake in another column is none."""
    lines = [f"{number},{number % 7},{number * 0.5},idle" for number in range(50_000)]
    path = tmp_path / "long.csv"
    path.write_text("\n".join(["# by hand", "t,U,x,say", *lines]) + "\n")
    table = read_table(path, wanted={"t", "x"})
    np.testing.assert_array_equal(table.column("x"), 0.5 * np.arange(50_000))
    assert table.place(49_999) == "line 50002"
    lines[44_443] = "44443,?,,idle"
    path.write_text("\n".join(["# by hand", "t,U,x,say", "", *lines]) + "\n")
    table = read_table(path, wanted={"t", 3})
    with pytest.raises(MeasuredDataError, match="line 44447, column 'x': the cell is empty"):
        table.column("x")
    assert np.flatnonzero(np.isnan(table.column("x", gaps=True))).tolist() == [44_443]
    assert table.column("t").size == 50_000
    lines[44_443] = "44443,1"
    path.write_text("\n".join(["t,U,x,say", *lines]) + "\n")
    with pytest.raises(MeasuredDataError, match="line 44445 has 2 cells, expected 4"):
        read_table(path)


def test_a_long_log_is_read_in_little_memory(tmp_path: Path) -> None:
    """300,000 lines of 12 columns: what stays is 8 bytes a number of the three that are asked for, and one block of text."""
    path = tmp_path / "long.csv"
    cells = ",".join("1234.5678" for _ in range(10))
    with path.open("w") as file:
        file.write("t,U," + ",".join(f"c{k}" for k in range(10)) + "\n")
        for number in range(300_000):
            file.write(f"{number},5,{cells}\n")
    size = path.stat().st_size
    code = (
        "import resource, sys\nfrom smajax.data.readers.read import read_table\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "table = read_table(sys.argv[1], {'t', 'U', 'c3'})\n"
        "assert table.column('c3').size == 300_000\n"
        "print(1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before))"
    )
    told = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    grown, kept = int(told.stdout), 3 * 8 * 300_000
    assert kept < size / 4
    assert grown < 4 * kept + 60e6, f"{grown / 1e6:.0f} MB for a file of {size / 1e6:.0f} MB"


@pytest.mark.slow
def test_too_little_memory_is_reported(tmp_path: Path) -> None:
    """A cap on memory while the log is read: one message, no traceback."""
    experiment, small = bench(tmp_path / "bench"), bench(tmp_path / "small")
    (experiment.parent / "a.csv").write_text("t,U,x\n" + "".join(f"{k},5,1\n" for k in range(2_500_000)))
    code = (
        "import resource, sys\nimport smajax.data.model_catalogue, smajax.attribution.close_loop, smajax.cli.progress_display, smajax.report.write\n"
        "from smajax.cli.main import main\nfrom smajax.core.runtime import prepare\nprepare()\n"
        # Units, threads and compiled programs are there before the cap: LLVM ends a program that it has no memory for.
        "from smajax.data.model_catalogue import CATALOGUE\nfrom smajax.data.experiment.load import load_experiment\n"
        f"load_experiment({str(small)!r}, CATALOGUE)\n"
        "used = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
        "resource.setrlimit(resource.RLIMIT_AS, (used + (16 << 20),) * 2)\n"
        "main()"
    )
    if not Path("/proc/self/statm").exists():
        pytest.skip("no /proc, by which the memory in use is known")
    told = subprocess.run(
        [sys.executable, "-c", code, "close-loop", str(experiment), "--out", str(tmp_path / "out")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 2, told.stderr[-2000:]
    assert "memory" in told.stderr
    assert "Traceback" not in told.stderr
