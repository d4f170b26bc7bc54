"""Parquet files, and NetCDF files of version 3 and 4."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from smajax.data.readers.read import read_table
from smajax.data.readers.table import MeasuredDataError
from tests.helpers.text_files import written


def test_parquet_files_are_read(tmp_path: Path) -> None:
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


def test_netcdf_3_files_are_read(tmp_path: Path) -> None:
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
