"""What all readers share: which files are refused, where a sample is, and that time increases."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io

from smajax.data.readers.duplicate_times import once
from smajax.data.readers.optional_packages import needed
from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError, check_time
from tests.helpers.text_files import written


def test_a_sample_is_named_by_its_line_in_the_file(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.csv", "# made by hand\n\ntime,x\n0,1\n\n1,2\n"))
    assert [table.place(0), table.place(1)] == ["line 4", "line 6"]
    scipy.io.savemat(tmp_path / "run.mat", {"x": np.arange(3.0)})
    assert read_table(tmp_path / "run.mat").place(1) == "sample 2"


def test_missing_files_and_files_of_another_kind_are_named(tmp_path: Path) -> None:
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


def test_files_that_do_not_match_their_suffix_are_named(tmp_path: Path) -> None:
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


def test_a_library_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(MeasuredDataError, match=r"needs no_such_library: pip install 'smajax\[formats\]', or else"):
        needed("no_such_library", tmp_path / "run.mat", "or else")


def test_repeated_times_are_refused_averaged_or_the_last_is_taken() -> None:
    time, values = np.array([0.0, 1.0, 1.0, 2.0, 2.0]), np.array([5.0, 6.0, 6.0, 7.0, 9.0])
    found = {how: once(time, values, how) for how in ("refuse", "mean", "last")}
    np.testing.assert_array_equal(found["refuse"][0], [0.0, 1.0, 2.0, 2.0])  # those that differ are left to be refused
    np.testing.assert_array_equal(found["mean"][1], [5.0, 6.0, 8.0])
    np.testing.assert_array_equal(found["last"][1], [5.0, 6.0, 9.0])
    assert [one[2] for one in found.values()] == [1, 2, 2]
