"""The folder that a command writes: one result in it, never two mixed, and none left behind by a command that was refused.

A hidden file in the folder says which command began it and what was asked. The same command goes on there; another one, or
the same one asked otherwise, is refused, unless it is to overwrite.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from smajax.cli.options import INSIDE
from smajax.core.files import json_text, replace, sweep_up

MARK = ".smajax.json"
# By the file that each command writes last another one refuses a folder without the mark, which may be the user's own.
LAST = {
    "report.html": "close-loop",
    "identify.html": "identify",
    "tune.html": "tune",
    "sweep.json": "sweep",
    ".made-by": "figures",
}
MOST_TOLD, LONGEST = 4, 60  # differences in a message, characters of a value in it
Asked = Mapping[str, Any]


class FolderTaken(ValueError):
    """The output folder holds another result, or another program is writing into it."""


class FolderUnusable(OSError):
    """The output folder cannot be written to."""


def _same(before: Asked, asked: Asked) -> bool:
    return dict(before) == dict(asked)


def _unlike(before: Asked, asked: Asked) -> Iterator[str]:
    """Each entry that differs, in words; of a table in the place of a value, its entries."""
    for name in sorted(before.keys() | asked.keys()):
        old, new = before.get(name), asked.get(name)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            yield from (f"changed in the {name}, {one}" for one in _unlike(old, new))
        elif old != new:
            there = f"{_short(old)} there" if name in before else "not there"
            yield f"{name}: {there}, {_short(new) if name in asked else 'not'} asked"


def _short(value: Any) -> str:
    text = "a table" if isinstance(value, Mapping) else "none" if value is None else str(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _differences(before: Asked, asked: Asked) -> str:
    differ = list(_unlike(before, asked))
    more = len(differ) - MOST_TOLD
    return "; ".join([*differ[:MOST_TOLD], *([f"and {more} more"] if more > 0 else [])])


def _read(out: Path) -> dict[str, Any] | None:
    try:
        held = json.loads((out / MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return held if isinstance(held, dict) and {"command", "asked"} <= held.keys() else None


def _other(out: Path, command: str, asked: Asked, own: Sequence[str], goes_on: Callable[[Asked, Asked], bool]) -> str:
    """What else `out` holds, in words; empty where it may be written to."""
    held = _read(out)
    if held is None:
        there = sorted(str(one.relative_to(out)) for pattern in own for one in out.glob(pattern))
        if there:
            return f"what this command would write over ({', '.join(there[:3])})"
        whose = {LAST[name]: name for name in LAST if (out / name).exists()}
        told = " and ".join(f"`smajax {one}` ({name})" for one, name in whose.items())
        return f"what may be a result of {told}" if told else ""
    if held["command"] != command:
        return f"a result of `smajax {held['command']}`"
    if goes_on(held["asked"], asked):
        return ""
    return f"another result of `smajax {command}` ({_differences(held['asked'], asked)})"


def _names_files(pattern: Any) -> bool:
    """Whether a pattern of the mark, a file like any other, names files of smajax: not everything, in no other folder."""
    if not isinstance(pattern, str):
        return False
    folder, _, names = pattern.rpartition("/")
    return INSIDE.get(folder) == names if folder else ".." not in pattern and bool(pattern.strip("*?."))


def _clear(out: Path, own: Sequence[str]) -> None:
    """Delete what smajax wrote there; what else is there stays."""
    held = _read(out) or {}
    ours: set[Path] = set()
    for pattern in {*own, *filter(_names_files, held.get("files", ())), MARK}:
        for one in out.glob(pattern):
            if one.is_dir() and not one.is_symlink():  # a mark of an earlier version names the folder as a whole
                ours.update(one.glob(INSIDE[one.name]) if one.name in INSIDE else ())
            elif one.parent == out or not one.parent.is_symlink():
                ours.add(one)
    for one in ours:
        one.unlink()
    for folder in {one.parent for one in ours} - {out}:
        if not any(folder.iterdir()):
            folder.rmdir()


def _made(out: Path) -> list[Path]:
    """Create the folder; those that were not there before, the innermost first."""
    new = [part for part in (out, *out.parents) if not part.exists()]
    out.mkdir(parents=True, exist_ok=True)
    return new


def _abandon(out: Path, new: Sequence[Path]) -> None:
    """Take back what was created, where nothing has been written into it."""
    if any(one.is_file() and one.name != MARK for one in out.rglob("*")):
        return
    if not new:
        (out / MARK).unlink(missing_ok=True)
        return
    shutil.rmtree(out)
    for part in new[1:]:
        if any(part.iterdir()):
            break
        part.rmdir()


def check_path(out: Path) -> None:
    """NotADirectoryError where a file is in the way: told before the work, not after it."""
    for part in (out, *out.parents):
        if part.exists() and not part.is_dir():
            raise NotADirectoryError(f"--out: {part} is a file; give the name of a folder.")


@contextmanager
def claimed(
    out: Path,
    command: str,
    asked: Asked,
    own: Sequence[str],
    overwrite: bool = False,
    goes_on: Callable[[Asked, Asked], bool] = _same,
) -> Iterator[Path]:
    """`out`, made and marked as `command`'s; within it the work is done.

    asked: what tells this result from another, JSON values. own: names (globs) that the command writes there, all that
    `overwrite` deletes. goes_on(before, asked): whether a result begun as `before` may be gone on with as `asked`.
    Raises NotADirectoryError where a file is in the way, FolderTaken for a folder that holds another result.
    """
    check_path(out)
    asked = json.loads(json.dumps(dict(asked)))
    there = out.is_dir()
    try:
        new = _made(out)
    except OSError as error:
        raise FolderUnusable(
            f"--out {out} cannot be made ({error.strerror}); give the name of another folder"
        ) from None
    with _alone(out):
        yield from _marked(out, command, asked, own, overwrite, goes_on, there, new)


@contextmanager
def _alone(out: Path) -> Iterator[None]:
    """While it is held no other smajax writes into `out`. A program that ends, however it does, lets go of it."""
    handle = os.open(out, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FolderTaken(
                f"--out {out}: another smajax is writing into it; wait until it has ended, or give the name of another folder."
            ) from None
        except OSError:
            pass  # a file system without locks
        yield
    finally:
        os.close(handle)


def _marked(
    out: Path,
    command: str,
    asked: Asked,
    own: Sequence[str],
    overwrite: bool,
    goes_on: Callable[[Asked, Asked], bool],
    there: bool,
    new: Sequence[Path],
) -> Iterator[Path]:
    """What `claimed` does in a folder that is there and nobody else's."""
    if there:
        other = _other(out, command, asked, own, goes_on)
        if other and not overwrite:
            raise FolderTaken(
                f"--out {out} holds {other}: give the name of another folder, or --overwrite to delete that."
            )
        if overwrite:
            _clear(out, own)
    marked = (out / MARK).exists()
    sweep_up(out)
    try:
        replace(out / MARK, json_text({"command": command, "asked": asked, "files": list(own)}))
    except OSError as error:
        if new:
            _abandon(out, new)
        raise FolderUnusable(
            f"--out {out} cannot be written to ({error.strerror}); give the name of another folder, or the right to write there"
        ) from None
    try:
        yield out
    except BaseException:
        if not marked:
            _abandon(out, new)
        raise
