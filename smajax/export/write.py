"""What an export writes: all of its files or none."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from smajax.core.files import writing
from smajax.export.errors import ExportError
from smajax.export.fmu import fmu
from smajax.export.source import CSource


def check_free(paths: list[Path], overwrite: bool) -> None:
    """ExportError where a file is there already, and where a folder is that cannot be one."""
    for path in paths:
        if path.is_dir():
            raise ExportError(f"{path} is a folder; expected the name of a file.")
        if path.exists() and not overwrite:
            raise ExportError(f"{path} is there already: give another --out, or --overwrite to replace it.")
        if path.parent.exists() and not path.parent.is_dir():
            raise ExportError(f"{path.parent} is a file; expected a folder to write into.")


def c_paths(folder: Path, name: str) -> list[Path]:
    """The files of a block in C."""
    return [folder / f"{name}.h", folder / f"{name}.c"]


def write_c(source: CSource, folder: Path, overwrite: bool = False) -> list[Path]:
    """Header and source; the paths. Raises ExportError where one is there already."""
    paths = c_paths(folder, source.name)
    check_free(paths, overwrite)
    folder.mkdir(parents=True, exist_ok=True)
    with ExitStack() as both:
        # Both are whole beside their places before either gets its name.
        files = [both.enter_context(writing(path)) for path in paths]
        for file, text in zip(files, (source.header, source.source), strict=True):
            file.write(text.encode("utf-8"))
    return paths


def write_fmu(source: CSource, path: Path, version: str = "2.0", binary: bool = True, overwrite: bool = False) -> Path:
    """The unit as one file; its path. Raises ExportError as `fmu`, and where the file is there already."""
    check_free([path], overwrite)
    content = fmu(source, version, binary)
    path.parent.mkdir(parents=True, exist_ok=True)
    with writing(path) as file:
        file.write(content)
    return path
