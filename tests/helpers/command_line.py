"""`smajax` in a folder, without a process of its own."""

from __future__ import annotations

import contextlib
from pathlib import Path

from tests.helpers.small_bench import Ended, smajax

DEMO = Path(__file__).parents[2] / "smajax" / "data" / "demo" / "latent"


def smajax_in(*arguments: str, cwd: Path) -> Ended:
    """The command in a folder, without a process of its own, whose imports take longer than all that is tested here."""
    with contextlib.chdir(cwd):
        return smajax(*arguments)
