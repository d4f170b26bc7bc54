"""JAX is set up once, by the first request that needs it or by a thread at the start: the first page does not wait for it."""

from __future__ import annotations

import threading

from smajax.core import runtime

_ONCE = threading.Lock()
_DONE: list[bool] = []
_LOADED: list[bool] = []


def ready() -> None:
    """What every command does before its first array (`runtime.prepare`), once."""
    with _ONCE:
        if not _DONE:
            runtime.prepare()
            _DONE.append(True)


def loaded() -> bool:
    """Whether a page that needs JAX has it at hand."""
    return bool(_LOADED)


def warm() -> None:
    """Load what the pages need, while the person looks at the first one."""
    ready()
    import smajax.data.experiment.draft
    import smajax.data.open_experiment
    import smajax.report.pictures  # noqa: F401

    _LOADED.append(True)
