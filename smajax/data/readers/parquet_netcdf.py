"""Files of named columns made by other programs: Parquet, and NetCDF as xarray reads it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from smajax.data.readers.clock_times import EPOCH
from smajax.data.readers.optional_packages import needed
from smajax.data.readers.table import Array, MeasuredDataError, Table


def _table(path: Path, given: Mapping[str, np.ndarray], stated: Mapping[str, str] | None = None) -> Table:
    """Numbers as they are, moments as seconds since the first; anything else is said when it is asked for.

    stated: units by name, for the columns that the file gives one.
    """
    columns: dict[str, Array] = {}
    units = dict(stated or {})
    unusable: dict[str, str] = {}
    moments: dict[str, int] = {}
    for name, values in given.items():
        if values.dtype.kind == "M":
            if values.size and not np.isnat(values[0]):
                moments[name] = EPOCH + int(values[0].astype("datetime64[ns]").astype(np.int64))
            columns[name] = (values - values[0]) / np.timedelta64(1, "s") if values.size else np.zeros(0)
            units[name] = "s"
        elif values.dtype.kind == "m":
            columns[name] = values / np.timedelta64(1, "s")
            units[name] = "s"
        elif values.dtype.kind in "fiub":
            columns[name] = values.astype(np.float64)
        else:
            unusable[name] = f"column {name!r} holds {values.dtype}; expected numbers"
    if not columns:
        raise MeasuredDataError(
            f"{path}: no column of numbers in it{'; ' if unusable else ''}{'; '.join(unusable.values())}"
        )
    return Table(path=path, columns=columns, unusable=unusable, order=tuple(given), units=units, moments=moments)


def read_parquet(path: Path) -> Table:
    """Reads a Parquet file; a missing value is nan. Raises MeasuredDataError."""
    parquet = needed("pyarrow.parquet", path)
    try:
        held = parquet.read_table(path)
    except MemoryError:
        raise
    except Exception as error:  # pyarrow's own kinds of errors
        raise MeasuredDataError(f"{path}: is no Parquet file, or a damaged one ({error})") from error
    return _table(path, {name: held.column(name).to_numpy() for name in held.column_names})


def read_netcdf(path: Path) -> Table:
    """Reads every variable with one dimension, coordinates too, with its attribute `units`. Raises MeasuredDataError.

    NetCDF 3 is read by scipy; version 4 needs the extra `formats`.
    """
    import xarray as xr

    with path.open("rb") as file:
        fourth = file.read(4) == b"\x89HDF"
    if fourth:
        needed("h5netcdf", path)
    try:
        with xr.open_dataset(path, engine="h5netcdf" if fourth else "scipy", decode_times=True) as held:
            flat = {str(name): held[name].to_numpy() for name in held.variables if held[name].ndim == 1}
            units = {name: str(held[name].attrs["units"]) for name in flat if held[name].attrs.get("units")}
    except MemoryError:
        raise
    except Exception as error:  # what a damaged file raises is the engine's
        raise MeasuredDataError(f"{path}: is no NetCDF file, or a damaged one ({error})") from error
    return _table(path, flat, units)
