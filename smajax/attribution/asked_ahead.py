"""What a later stage will ask, asked of a second process as soon as its arguments are known.

While this process waits for an answer that stage is shown, and the answer brings what the second process has found in the cache and saved there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from smajax.attribution.model_fits import Search
from smajax.core.progress import Stage
from smajax.core.result_cache import Counts
from smajax.core.worker_process import Call, begin_call, is_called

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class AskedAhead(Generic[Result]):
    """A question of a stage, which the second process may be at."""

    setting: Search
    stage: str
    call: Call[tuple[Result, Counts | None]]

    def result(self) -> Result:
        """The answer, by this process where the other one has not begun with it."""
        waits = is_called(self.call)
        if waits:
            self.setting.progress(Stage(self.stage, 0.0))
        found, counts = self.call.result()
        if waits:
            self.setting.progress(Stage(self.stage, 1.0))
        if counts is not None:
            self.setting.cache.add(counts)
        return found


def ask_ahead(stage: str, setting: Search, function: Callable[..., Result], *arguments: Any) -> AskedAhead[Result]:
    """Have `function(setting, *arguments)`, of a module, called by the second process, where there is one."""
    here = partial(_here, function, setting, *arguments)
    return AskedAhead(setting, stage, begin_call(here, _there, function, setting.alone(), *arguments))


def _here(function: Callable[..., Result], setting: Search, *arguments: Any) -> tuple[Result, Counts | None]:
    return function(setting, *arguments), None


def _there(function: Callable[..., Result], setting: Search, *arguments: Any) -> tuple[Result, Counts | None]:
    return function(setting, *arguments), setting.cache.counts
