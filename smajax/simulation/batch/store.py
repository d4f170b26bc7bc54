"""A batch on disk: a Zarr group that is filled chunk by chunk, by one process or several, and resumed later.

Each chunk of a result is one file per array, written under another name and renamed; a chunk counts as done when its
mark is there, which comes last. So whatever moment a process is killed at, what is marked is whole.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from smajax.core.extras import optional_package
from smajax.simulation.batch.axes import Axes, Dimension

if TYPE_CHECKING:
    import zarr

MARK = "done"  # one number a chunk: 1 when it is whole
DIGEST, CHUNK, AXES = "digest", "chunk", "axes"


def _zarr() -> Any:
    """zarr. MissingExtraError says how to install it."""
    return optional_package("zarr", "store", "a batch on disk")


class Store:
    """The folder of one batch."""

    def __init__(self, folder: Path, group: zarr.Group) -> None:
        self.folder = folder
        self.group: Any = group  # what it gives for a name has other types in other versions of zarr

    @classmethod
    def opened(cls, folder: Path) -> Store:
        """An existing one. FileNotFoundError when there is none."""
        try:
            return cls(folder, _zarr().open_group(folder, mode="r+"))
        except FileNotFoundError:
            raise FileNotFoundError(f"there is no batch in {folder}.") from None

    @classmethod
    def created(
        cls,
        folder: Path,
        axes: Axes,
        chunk: int,
        shapes: Mapping[str, tuple[tuple[int, ...], np.dtype]],
        attributes: Mapping[str, Any],
        units: Mapping[str, str],
    ) -> Store:
        """A new one with nothing in it. `shapes` are those of one run; `attributes` have the digest of what is run."""
        # Laid out beside its place and renamed: a folder under its own name is whole.
        part = folder.with_name(f"{folder.name}.part")
        group = _zarr().open_group(part, mode="w", zarr_format=3)
        for name, (shape, dtype) in shapes.items():
            array = group.create_array(
                name,
                shape=(axes.size, *shape),
                chunks=(min(chunk, axes.size), *shape),
                dtype=dtype,
                fill_value=np.nan if np.issubdtype(dtype, np.floating) else 0,
                dimension_names=["run", *(["time"] if shape else [])],
            )
            array.attrs["units"] = units[name]
        count = -(-axes.size // chunk)
        values = group.create_group(AXES)
        for one in axes.dimensions:
            for name, series in one.values.items():
                points = np.asarray(series, dtype=float)
                array = values.create_array(name, shape=points.shape, dtype=points.dtype, dimension_names=[one.name])
                array[:] = points
                if name in units:
                    array.attrs["units"] = units[name]
        group.create_array(MARK, shape=(count,), chunks=(1,), dtype="uint8", fill_value=0, dimension_names=["chunk"])
        order = [[one.name, list(one.values)] for one in axes.dimensions]
        group.attrs.update({**attributes, CHUNK: chunk, AXES: json.dumps(order)})
        if folder.exists():
            folder.rmdir()  # empty, or it would have been refused
        part.rename(folder)
        return cls.opened(folder)

    @property
    def axes(self) -> Axes:
        values = self.group[AXES]
        order = json.loads(str(self.group.attrs[AXES]))
        return Axes(tuple(Dimension(name, {key: np.asarray(values[key][:]) for key in keys}) for name, keys in order))

    @property
    def axis_units(self) -> dict[str, str]:
        """Of what is varied, where it is known."""
        arrays: Any = self.group[AXES]
        units = {name: arrays[name].attrs.get("units") for one in self.axes.dimensions for name in one.values}
        return {name: str(unit) for name, unit in units.items() if unit}

    @property
    def chunk(self) -> int:
        chunk: Any = self.group.attrs[CHUNK]  # whose type hangs on the version of zarr
        return int(chunk)

    @property
    def digest(self) -> str:
        return str(self.group.attrs.get(DIGEST, ""))

    def missing(self) -> list[int]:
        """Chunks that are still to be computed."""
        return np.flatnonzero(np.asarray(self.group[MARK][:]) == 0).tolist()

    def write(self, number: int, results: Mapping[str, np.ndarray]) -> None:
        """Chunk `number`, then its mark."""
        start = number * self.chunk
        for name, values in results.items():
            self.group[name][start : start + len(values)] = values
        self.group[MARK][number] = 1

    def names(self) -> Sequence[str]:
        return [name for name in self.group.array_keys() if name != MARK]
