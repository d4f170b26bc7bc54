"""The folder that a command writes: one result in it, never two mixed, and none left by a command that was refused.

A hidden file in the folder records the command and its request. The same command resumes there; another one, or the same one
with another request, is refused, unless it is to overwrite.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from smajax.cli.options import INSIDE
from smajax.core.files import json_text, replace, sweep_up
from smajax.core.operating_system import Taken, locked

MARK = ".smajax.json"
LOCK = ".smajax.lock"  # stays, so that programs that come at the same moment lock the same file
# The last file of each command: a folder that has one but no hidden file is refused, since it may be the user's own.
LAST = {
    "report.html": "close-loop",
    "check.html": "check",
    "identify.html": "identify",
    "predict.html": "predict",
    "tune.html": "tune",
    "sweep.json": "sweep",
    ".made-by": "figures",
}
MOST_LISTED, LONGEST = 4, 60  # differences in a message, characters of a value in it
Request = Mapping[str, Any]


class FolderTaken(ValueError):
    """The output folder holds another result, or another program is writing into it."""


class FolderUnusable(OSError):
    """The output folder cannot be written to."""


def _same(before: Request, request: Request) -> bool:
    return dict(before) == dict(request)


def _changes(before: Request, request: Request) -> Iterator[str]:
    """Each entry that differs, in words; of a table, its entries."""
    for name in sorted(before.keys() | request.keys()):
        old, new = before.get(name), request.get(name)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            yield from (f"changed in the {name}, {one}" for one in _changes(old, new))
        elif old != new:
            there = f"{_short(old)} there" if name in before else "not there"
            yield f"{name}: {there}, {_short(new) if name in request else 'not'} requested"


def _short(value: Any) -> str:
    text = "a table" if isinstance(value, Mapping) else "none" if value is None else str(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _differences(before: Request, request: Request) -> str:
    differ = list(_changes(before, request))
    more = len(differ) - MOST_LISTED
    return "; ".join([*differ[:MOST_LISTED], *([f"and {more} more"] if more > 0 else [])])


def _read(out: Path) -> dict[str, Any] | None:
    try:
        record = json.loads((out / MARK).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if isinstance(record, dict) and "asked" in record:  # the key of version 0.1
        record["request"] = record.pop("asked")
    return record if isinstance(record, dict) and {"command", "request"} <= record.keys() else None


def _other_result(
    out: Path, command: str, request: Request, patterns: Sequence[str], may_resume: Callable[[Request, Request], bool]
) -> str:
    """The other result that `out` holds, in words; "" where the command may write there."""
    record = _read(out)
    if record is None:
        there = sorted(str(one.relative_to(out)) for pattern in patterns for one in out.glob(pattern))
        if there:
            return f"what this command would write over ({', '.join(there[:3])})"
        whose = {LAST[name]: name for name in LAST if (out / name).exists()}
        commands = " and ".join(f"`smajax {one}` ({name})" for one, name in whose.items())
        return f"what may be a result of {commands}" if commands else ""
    if record["command"] != command:
        return f"a result of `smajax {record['command']}`"
    if may_resume(record["request"], request):
        return ""
    return f"another result of `smajax {command}` ({_differences(record['request'], request)})"


def _names_files(pattern: Any) -> bool:
    """Whether a pattern of the hidden file names files of smajax: not everything, and in no other folder."""
    if not isinstance(pattern, str):
        return False
    folder, _, names = pattern.rpartition("/")
    return INSIDE.get(folder) == names if folder else ".." not in pattern and bool(pattern.strip("*?."))


def _clear(out: Path, patterns: Sequence[str]) -> None:
    """Delete what smajax wrote there; what else is there stays."""
    record = _read(out) or {}
    ours: set[Path] = set()
    for pattern in {*patterns, *filter(_names_files, record.get("files", ())), MARK}:
        for one in out.glob(pattern):
            if (
                one.is_dir() and not one.is_symlink()
            ):  # the hidden file of an earlier version names the folder as a whole
                ours.update(one.glob(INSIDE[one.name]) if one.name in INSIDE else ())
            elif one.parent == out or not one.parent.is_symlink():
                ours.add(one)
    for one in ours:
        one.unlink()
    for folder in {one.parent for one in ours} - {out}:
        if not any(folder.iterdir()):
            folder.rmdir()


def _create(out: Path) -> list[Path]:
    """Create the folder; those that were not there before, the innermost first."""
    new = [part for part in (out, *out.parents) if not part.exists()]
    out.mkdir(parents=True, exist_ok=True)
    return new


def _abandon(out: Path, new: Sequence[Path]) -> None:
    """Where nothing was written, remove the mark and, of a created folder, the folders in it."""
    if any(one.is_file() and one.name not in (MARK, LOCK) for one in out.rglob("*")):
        return
    (out / MARK).unlink(missing_ok=True)
    for one in out.iterdir() if new else ():
        if one.is_dir():
            shutil.rmtree(one)


def _leave(out: Path, new: Sequence[Path]) -> None:
    """A folder that was not marked is as it was before. Without the lock, since Windows does not delete a file that is open."""
    if (out / MARK).exists():
        return
    with suppress(OSError):  # not empty, or another program has come
        (out / LOCK).unlink(missing_ok=True)
        for part in new:
            part.rmdir()


def check_path(out: Path) -> None:
    """NotADirectoryError where a file is in the way: before the work, not after it."""
    for part in (out, *out.parents):
        if part.exists() and not part.is_dir():
            raise NotADirectoryError(f"--out: {part} is a file; give the name of a folder.")


@contextmanager
def claimed(
    out: Path,
    command: str,
    request: Request,
    patterns: Sequence[str],
    overwrite: bool = False,
    may_resume: Callable[[Request, Request], bool] = _same,
) -> Iterator[Path]:
    """`out`, created and marked as `command`'s while the command works in it.

    request: what distinguishes this result from another, JSON values. patterns: names (globs) of the files that the command
    writes there, which `overwrite` deletes. may_resume(before, request): whether `request` may resume a result of `before`.
    Raises NotADirectoryError where a file is in the way, FolderTaken for a folder that holds another result.
    """
    check_path(out)
    request = json.loads(json.dumps(dict(request)))
    there = out.is_dir()
    try:
        new = _create(out)
    except OSError as error:
        raise FolderUnusable(
            f"--out {out} cannot be created ({error.strerror}); give the name of another folder"
        ) from None
    try:
        with locked(out / LOCK):
            yield from _marked(out, command, request, patterns, overwrite, may_resume, there, new)
    except Taken:
        raise FolderTaken(
            f"--out {out}: another smajax is writing into it; wait until it has ended, or give the name of another folder."
        ) from None
    except BaseException:
        _leave(out, new)
        raise


def _marked(
    out: Path,
    command: str,
    request: Request,
    patterns: Sequence[str],
    overwrite: bool,
    may_resume: Callable[[Request, Request], bool],
    there: bool,
    new: Sequence[Path],
) -> Iterator[Path]:
    """`claimed` in an existing folder that is locked."""
    if there:
        other = _other_result(out, command, request, patterns, may_resume)
        if other and not overwrite:
            raise FolderTaken(
                f"--out {out} holds {other}: give the name of another folder, or --overwrite to delete that."
            )
        if overwrite:
            _clear(out, patterns)
    marked = (out / MARK).exists()
    sweep_up(out)
    try:
        replace(out / MARK, json_text({"command": command, "request": request, "files": list(patterns)}))
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
