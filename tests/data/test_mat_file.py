"""MATLAB files of version 5 and 7.3."""

from __future__ import annotations

import struct
import tracemalloc
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from smajax.data.experiment.column_guess import columns_of
from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError


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


def test_a_matlab_object_is_left_unread_however_deep(tmp_path: Path) -> None:
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
def test_damaged_structs_do_not_allocate_the_memory_that_they_announce(
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
def test_signals_of_a_scope_are_named_by_labels_and_logged_signals_by_fields(tmp_path: Path, version: str) -> None:
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


def test_missing_mat_variables_and_ones_of_another_structure_are_named(tmp_path: Path) -> None:
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
