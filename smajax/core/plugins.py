"""Parts that other packages bring, by entry point: `smajax.effects` and `smajax.loads`.

    [project.entry-points."smajax.effects"]
    my_effect = "my_package.my_effect:MyEffect"

    [project.entry-points."smajax.loads"]
    my_load = "my_package.my_load:my_load"

An effect is a class; a load is a function without arguments that returns one. They are loaded with the table that they
belong to. A name that is taken is refused, and a package that cannot be loaded is named: a study that went on without a
part that it asks for would say something else than it seems to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar

EFFECTS, LOADS = "smajax.effects", "smajax.loads"
Part = TypeVar("Part")


class PluginError(RuntimeError):
    """An entry point that cannot be used: which, of which package, why, what to do."""


def resolved(table: Mapping[str, Part | str]) -> dict[str, Part]:
    """A table of our own parts with those imported that it names as an entry point does, `package.module:name`.

    A part in a file of its own is so one line of a table. Raises ImportError or AttributeError where there is none.
    """
    return {
        name: EntryPoint(name, part, group="").load() if isinstance(part, str) else part for name, part in table.items()
    }


def whose(point: EntryPoint) -> str:
    """The entry point in words: name, place, package, group."""
    package = f" of {point.dist.name} {point.dist.version}" if point.dist is not None else ""
    return f"the entry point `{point.name} = {point.value}`{package} in the group {point.group!r}"


def points_of(group: str) -> list[EntryPoint]:
    """The entry points of a group, in the order of their names."""
    return sorted(entry_points(group=group), key=lambda one: (one.name, one.value))


def brought(group: str, own: Mapping[str, Part], check: Callable[[str, Any], str]) -> dict[str, Part]:
    """What other packages bring to the table `own`, by name, in the order of the names.

    check(name, part) says what is wrong with a part, or nothing. Raises PluginError, a line each, for parts that cannot be
    loaded, are not what they should be, or have a name that is taken.
    """
    result: dict[str, Part] = {}
    faults = []
    for point in points_of(group):
        try:
            part = point.load()
        except Exception as error:
            faults.append(f"{whose(point)} cannot be loaded ({error!r}): mend or uninstall that package.")
            continue
        if point.name in own or point.name in result:
            faults.append(f"{whose(point)} has a name that is taken: rename it there, or uninstall that package.")
        elif wrong := check(point.name, part):
            faults.append(f"{whose(point)} {wrong}.")
        else:
            result[point.name] = part
    if faults:
        raise PluginError("\n".join(faults))
    return result


@lru_cache(maxsize=1)
def versions() -> tuple[str, ...]:
    """`group name package version` of every part that other packages bring: kept work of another set is other work."""
    points = [point for group in (EFFECTS, LOADS) for point in entry_points(group=group)]
    return tuple(
        sorted(f"{one.group} {one.name} {one.dist.name} {one.dist.version}" for one in points if one.dist is not None)
    )
