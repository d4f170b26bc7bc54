"""Files that nobody meant, by the thousand: the readers answer each with a result or with their own error, in bounded time and memory.

How many inputs: FAST each in `make test`, SLOW each in `make test-all`.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import resource
import tempfile
from collections.abc import Callable
from datetime import timedelta
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from smajax.control.gains_file import Gains, GainsFileError, read_gains
from smajax.core.units import UnitError, convert, parse_quantity
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError, Table
from smajax.model.presets import build
from tests.helpers.small_bench import BENCH, log

FAST, SLOW = 150, 10_000
LONGEST = timedelta(seconds=5)  # of one input
MOST_MEMORY = 400e6  # bytes that the process may have grown by after all of them


def fuzzed(*strategies: st.SearchStrategy) -> Callable:
    """A test of each input, as a fast one whose inputs are the same every time, and a slow one whose are not."""

    def both(test: Callable) -> Callable:
        quiet = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.data_too_large]
        common = {"deadline": LONGEST, "suppress_health_check": quiet, "database": None}
        asked = given(*strategies)

        @pytest.mark.parametrize("count", [FAST, pytest.param(SLOW, marks=pytest.mark.slow)])
        def run(count: int) -> None:
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            settings(max_examples=count, derandomize=count == FAST, **common)(asked(test))()  # type: ignore[arg-type]
            grown = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
            assert grown < MOST_MEMORY, f"{grown / 1e6:.0f} MB"

        run.__name__, run.__doc__ = test.__name__, test.__doc__
        return run

    return both


@st.composite
def spoilt(draw: st.DrawFn, seeds: tuple[bytes, ...]) -> bytes:
    """A sound file with pieces cut out, put in, repeated, or written over."""
    content = bytearray(draw(st.sampled_from(seeds)))
    for _ in range(draw(st.integers(0, 6))):
        at, length = draw(st.integers(0, max(len(content) - 1, 0))), draw(st.integers(0, 24))
        match draw(st.sampled_from(["cut", "put", "repeat", "bits", "end"])):
            case "cut":
                del content[at : at + length]
            case "put":
                content[at:at] = draw(st.binary(max_size=12) | st.sampled_from(PIECES))
            case "repeat":
                content[at:at] = content[at : at + length] * draw(st.integers(1, 5))
            case "bits" if content:
                content[at] ^= draw(st.integers(1, 255))
            case "end":
                del content[at:]
    return bytes(content)


PIECES = [
    *(b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b'"', b"'", b",", b";", b"\t", b"#", b"=", b"[", b"]", b"{", b"}"),
    *(b"nan", b"inf", b"-0", b"1e999", b"9" * 400, b"1_0", b"0x1p3", "°".encode(), "٣".encode(), "​".encode()),
    *(b"../", b"/dev/zero", b"/dev/stdin", b"~", b"$HOME", b"${SMAJAX_DATA}", b"%s", b"{0}", b"\x1b[31m", b"<script>"),
]
CELL = st.sampled_from(
    ["1", "-2.5", "3,5", "1e3", "nan", "inf", "", "x", "1 2", '"4"', "1.000", "٣", "#", "9" * 400]
) | st.text(max_size=6)
ROWS = st.lists(st.lists(CELL, min_size=1, max_size=5), min_size=1, max_size=12)
CSV = (
    b"t,U,x\n0,5,0\n1,5,0.5\n2,0,1\n",
    b"t;U;x\n0;5,1;0,2\n1;5,2;0,5\n",
    b"# by hand\nT (degC) in x\n20 0,5\n21 0,7\n",
)


def _read(content: bytes, suffix: str) -> Table | None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"log{suffix}"
        path.write_bytes(content)
        said = ""
        try:
            return read_table(path)
        except MeasuredDataError as error:
            said = str(error)
        assert str(path) in said
        return None


def _sound(table: Table | None) -> None:
    """What a reader gives is numbers, and what it withholds has a reason."""
    for name in () if table is None else table.order or (*table.columns, *table.unusable):
        try:
            values = table.column(name)  # type: ignore[union-attr]
        except MeasuredDataError:
            continue
        assert values.dtype == np.float64
        assert values.ndim == 1
        assert np.isfinite(values).all()


@fuzzed(st.binary(max_size=300) | spoilt(CSV))
def test_text_tables_of_any_bytes(content: bytes) -> None:
    _sound(_read(content, ".csv"))


@fuzzed(ROWS, st.sampled_from([",", ";", "\t", " ", ", "]), st.sampled_from(["utf-8", "latin-1", "utf-16"]))
def test_text_tables_of_any_cells(rows: list[list[str]], mark: str, encoding: str) -> None:
    text = "\n".join(mark.join(cells) for cells in rows)
    _sound(_read(text.encode(encoding, errors="replace"), ".csv"))


def _mat(**variables: object) -> bytes:
    held = io.BytesIO()
    scipy.io.savemat(held, variables)
    return held.getvalue()


def _mat73() -> tuple[bytes, ...]:
    h5py = pytest.importorskip("h5py")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mat"
        with h5py.File(path, "w", userblock_size=512, libver="latest") as file:
            duty = file.create_group("Duty")
            duty["time"] = np.array([[0.0, 0.1, 0.2]])
            duty.create_group("signals")["values"] = np.array([[1.0, 2.0, 3.0]])
        with path.open("r+b") as raw:
            raw.write(b"MATLAB 7.3 MAT-file")
        return (path.read_bytes(),)


STRUCTURE = {"time": np.arange(3.0), "signals": {"values": np.arange(3.0), "dimensions": 1.0}}
MAT = (
    _mat(x=np.arange(6.0).reshape(3, 2), name="text"),
    _mat(Duty=STRUCTURE),
    _mat(cell=np.array([np.arange(3.0), STRUCTURE], dtype=object), odd=np.zeros((2, 2, 2))),
)


@fuzzed(spoilt(MAT))
def test_matlab_files_of_any_bytes(content: bytes) -> None:
    _sound(_read(content, ".mat"))


def test_a_matlab_file_that_ends_a_compiled_reader_is_refused() -> None:
    """Found by the test above: numbers announced, and an element of no type in their place."""
    whole = _mat(cell=np.array([np.arange(3.0) + 0.5, "x"], dtype=object))
    at = whole.rindex(b"\t\0\0\0\x18\0\0\0")  # the three numbers
    spoilt_one = whole[:at] + 8 * b"\0" + whole[at + 8 :]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mat"
        path.write_bytes(spoilt_one)
        with pytest.raises(MeasuredDataError, match=r"log.mat: the MATLAB file is damaged.*3 numbers are announced"):
            read_table(path)


@fuzzed(spoilt(_mat73()))
def test_matlab_73_files_of_any_bytes(content: bytes) -> None:
    _sound(_read(content, ".mat"))


FOLDER = Path(tempfile.mkdtemp())
for _name in ("a.csv", "b.csv"):
    log(FOLDER / _name, seconds=4.0)
QUICK = dataclasses.replace(CATALOGUE, describe=lru_cache(maxsize=64)(CATALOGUE.describe))
TOML = st.recursive(
    st.none().map(lambda _: "x")
    | st.booleans()
    | st.integers(-(10**20), 10**20)
    | st.floats()
    | st.sampled_from(
        ["50 ms", "1e999 m", "-1 V", "estimate", "fit", "input", "a.csv", "../a.csv", "/etc/passwd", "degC", "m**9**9"]
    )
    | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


def _as_toml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_as_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_as_toml, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value)


def _load(content: bytes) -> None:
    path = FOLDER / "experiment.toml"
    path.write_bytes(content)
    said, found = f"{path}", None
    try:
        found = load_experiment(path, QUICK)
    except ExperimentError as error:
        said = str(error)
    assert said.startswith(str(path))
    assert len(said) < 40_000
    for run in () if found is None else found.runs:
        assert all(file.resolve().is_relative_to(FOLDER.resolve()) for file in run.files)
        assert np.isfinite(run.output).all()


@fuzzed(spoilt((BENCH.encode(),)))
def test_experiment_files_of_any_bytes(content: bytes) -> None:
    _load(content)


LINES = [number for number, line in enumerate(BENCH.splitlines()) if "=" in line]


@fuzzed(st.lists(st.tuples(st.sampled_from(LINES), TOML), min_size=1, max_size=3))
def test_experiment_files_of_any_values(changes: list[tuple[int, object]]) -> None:
    """Sound TOML with values of any kind at any key."""
    lines = BENCH.splitlines()
    for number, value in changes:
        lines[number] = f"{lines[number].split('=')[0]}= {_as_toml(value)}"
    _load("\n".join(lines).encode("utf-8", errors="replace"))


@fuzzed(
    st.text(max_size=20)
    | st.lists(
        st.sampled_from(["m", "s", "degC", "V", "1", "9", "^", "**", "/", "*", "(", ")", " ", ".", "-", "²", "e"]),
        max_size=12,
    ).map("".join),
    st.sampled_from(["m", "degC", "rad", "1", "J/(kg K)"]),
)
def test_units_of_any_text(text: str, expected: str) -> None:
    for work in (lambda: convert(1.0, text, expected), lambda: parse_quantity(f"2 {text}", expected)):
        with contextlib.suppress(UnitError):
            assert np.asarray(work()).dtype.kind == "f"


@fuzzed(
    spoilt(
        (
            b'{"controller": "pid", "gains": {"proportional_gain": {"value": 12.8, "unit": "V/rad"}, "integral_gain": 3}}',
        )
    )
)
def test_gains_of_any_bytes(content: bytes) -> None:
    path = FOLDER / "gains.json"
    path.write_bytes(content)
    said = f"{path}"
    try:
        assert isinstance(read_gains(path, _ARM), Gains)
    except GainsFileError as error:
        said = str(error)
    assert str(path) in said


_ARM = build("niti_table_3_1", "arm", "amplified_voltage")
