"""Text tables with decimal commas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError
from tests.helpers.text_files import written


def test_headings_of_tab_separated_decimal_commas_may_hold_blanks(tmp_path: Path) -> None:
    table = read_table(written(tmp_path / "run.txt", "t [s]\tU [V]\n0,0\t1,5\n0,1\t2,5\n"))
    np.testing.assert_array_equal(table.column("U [V]"), [1.5, 2.5])


@pytest.mark.parametrize(
    "text",
    [
        "time;x\n0,0;1,5\n0,25;-2,5e1\n",
        "0,0 1,5\n0,25 -2,5e1\n",
        'time,x\n"0,0","1,5"\n"0,25","-2,5e1"\n',
        "time\tx\n0\t1,500\n0,25\t-25\n",
    ],
)
def test_decimal_commas_are_read(tmp_path: Path, text: str) -> None:
    table = read_table(written(tmp_path / "run.csv", text))
    np.testing.assert_array_equal(table.column(1), [0.0, 0.25])
    np.testing.assert_array_equal(table.column(2), [1.5, -25.0])


@pytest.mark.parametrize(
    "text", ["a x\n1,500 2,000\n2,250 3,125", 'a,x\n"1,500","2,000"\n"2,250","3,125"', "a;x\n1,500;2,000\n2,250;3,125"]
)
def test_declared_decimal_commas_are_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    table = read_table(tmp_path / "a.csv", decimal=",")
    np.testing.assert_array_equal(table.column("a"), [1.5, 2.25])
    np.testing.assert_array_equal(table.column("x"), [2.0, 3.125])


def test_one_column_of_decimal_commas_is_read(tmp_path: Path) -> None:
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
def test_a_declared_decimal_mark_that_the_file_contradicts_is_an_error(
    tmp_path: Path, text: str, decimal: str, words: str
) -> None:
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
