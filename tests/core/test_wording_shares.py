"""A share of samples as text: "100%" is of all of them."""

from __future__ import annotations

import pytest

from smajax.core.wording import per_cent


@pytest.mark.parametrize(
    ("share", "text"),
    [(1.0, "100%"), (599 / 600, "99.8%"), (0.9, "90%"), (0.0, "0%"), (1 / 600, "0.2%"), (1.0 - 1e-9, ">99.999%")],
)
def test_all_and_none_are_said_of_all_and_of_none_alone(share: float, text: str) -> None:
    assert per_cent(share) == text
