"""What the system says of itself, read from its files."""

from __future__ import annotations

from pathlib import Path

import pytest

from smajax.core.operating_system import _quota


@pytest.mark.parametrize(
    ("said", "cores"), [("max 100000", ()), ("100000 100000", (1,)), ("150000 100000", (2,)), ("", ()), (None, ())]
)
def test_the_cap_of_a_container_on_cores_is_read(said: str | None, cores: tuple[int, ...], tmp_path: Path) -> None:
    cap = tmp_path / "cpu.max"
    if said is not None:
        cap.write_text(f"{said}\n")
    assert _quota(cap) == cores
