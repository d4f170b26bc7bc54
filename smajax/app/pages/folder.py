"""The working folder: which folders there are below the chosen one, and a new one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from smajax.app.confined import OutsideError, inside, is_inside
from smajax.app.project import Project, read_project
from smajax.app.step import FieldError, Sent, Step


def page(project: Project) -> Mapping[str, Any]:
    found = []
    taken = {one.folder for one in project.results}
    for one in sorted(project.folder.iterdir()):
        if one.is_dir() and not one.name.startswith(".") and one.name not in taken and is_inside(project.root, one):
            own = one.relative_to(project.folder).as_posix()
            there = read_project(project.root, f"{project.own}/{own}" if project.own else own)
            found.append(
                {
                    "name": own,
                    "own": there.own,
                    "experiment": bool(there.text),
                    "logs": len(there.log_paths),
                    "results": sorted({result.command for result in there.results}),
                }
            )
    above = None if project.folder == project.root else project.folder.parent.relative_to(project.root).as_posix()
    return {"folders": found, "above": None if above is None else above.removeprefix(".")}


def save(project: Project, sent: Sent) -> str:
    name = sent.values.get("name", "").strip()
    if not name:
        raise FieldError("name", "give a name for the new folder")
    try:
        target = inside(project.root, (project.folder / name).as_posix())
    except OutsideError as error:
        raise FieldError("name", str(error)) from None
    if target.parent != project.folder:
        raise FieldError("name", f"{name!r}: one name, without slashes")
    try:
        target.mkdir()
    except FileExistsError:
        raise FieldError("name", f"{name!r} exists already") from None
    except OSError as error:
        raise FieldError("name", f"{name!r} cannot be made: {error.strerror}") from None
    return f"logs?folder={target.relative_to(project.root).as_posix()}"


STEP = Step("folder", "Folder", page, save, done=lambda project: True, light=True)
