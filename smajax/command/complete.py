"""What the Tab key offers for a value: names of what there is. Each imports its list when it is asked."""

from __future__ import annotations

from collections.abc import Iterable


def _offered(names: Iterable[str], begun: str) -> list[str]:
    return [name for name in names if name.startswith(begun)]


def wires(incomplete: str) -> list[str]:
    from smajax.presets import WIRES

    return _offered(WIRES, incomplete)


def loads(incomplete: str) -> list[str]:
    from smajax.presets import LOADS

    return _offered(LOADS, incomplete)


def drives(incomplete: str) -> list[str]:
    from smajax.presets import DRIVES

    return _offered(DRIVES, incomplete)


def laws(incomplete: str) -> list[str]:
    from smajax.wire.laws import LAWS

    return _offered(LAWS, incomplete)


def controllers(incomplete: str) -> list[str]:
    from smajax.control_presets import CONTROLLERS

    return _offered(CONTROLLERS, incomplete)


def several_controllers(incomplete: str) -> list[str]:
    """After the last comma; none twice."""
    *done, begun = incomplete.split(",")
    return [",".join([*done, name]) for name in controllers(begun) if name not in done]


def estimators(incomplete: str) -> list[str]:
    from smajax.control_presets import FILTERS

    return _offered(FILTERS, incomplete)


def figures(incomplete: str) -> list[str]:
    from smajax.figures.catalogue import CHAPTERS, every_row

    return _offered([*CHAPTERS, *(row.name for row in every_row())], incomplete)
