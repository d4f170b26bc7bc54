"""A grid of cases of which some are in `make test`, one for each value of each axis, and all in `make test-all`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def often(cases: Iterable[Any], chosen: Iterable[Any]) -> list[Any]:
    """Parameters of all `cases`, slow but for those that are `chosen`; a case of several values is a tuple."""
    every, quick = list(cases), list(chosen)
    assert all(one in every for one in quick), "chosen, and no case"
    return [
        pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=() if case in quick else pytest.mark.slow)
        for case in every
    ]
