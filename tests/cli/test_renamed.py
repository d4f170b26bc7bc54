"""Old names of commands and options work and warn."""

from __future__ import annotations

import pytest

from smajax.cli import renamed
from smajax.cli.main import main

OLD = {("sweep", "--targets"): ("--set-points", "0.3"), ("", "robustness"): ("sweep", "0.4")}


@pytest.mark.parametrize(
    ("typed", "now", "told"),
    [
        ("sweep --targets 20,40 --out x", "sweep --set-points 20,40 --out x", ["--targets is --set-points now"]),
        ("robustness --targets=20", "sweep --set-points=20", ["robustness is sweep now", "--targets is --set-points"]),
        ("tune --targets 20", "tune --targets 20", []),  # of another command
        ("sweep --out robustness -- --targets", "sweep --out robustness -- --targets", []),
        ("--version", "--version", []),
    ],
)
def test_an_old_name_works_and_names_the_new_one(typed: str, now: str, told: list[str]) -> None:
    found, said = renamed.with_new_names(typed.split(), OLD)
    assert found == now.split()
    assert [part in one for part, one in zip(told, said, strict=True)] == [True] * len(told)


def test_an_old_command_works_and_warns(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(
        "smajax.cli.main.with_new_names",
        lambda typed: renamed.with_new_names(typed, {("", "wires"): ("presets", "0.3")}),
    )
    monkeypatch.setattr("sys.argv", ["smajax", "wires"])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    assert not ended.value.code
    assert "flexinol_table_3_2" in out
    assert err == "deprecated: wires is presets now; the old name goes in version 0.3\n"
