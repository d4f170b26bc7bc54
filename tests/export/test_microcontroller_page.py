"""The commands of the page on microcontrollers, as they are printed: what they write is what its C and its compiler's line name."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from smajax.control.gains_file import Gains, write_gains
from smajax.model.presets import build
from tests.helpers.small_bench import smajax

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "to-a-microcontroller.md"
TEXT = PAGE.read_text(encoding="utf-8")
FENCE = re.compile(r"^```(\w+)[^\n]*\n(.*?)^```", re.MULTILINE | re.DOTALL)
BLOCKS = FENCE.findall(TEXT)
COMMANDS = [line for language, text in BLOCKS if language == "sh" for line in text.splitlines()]
(TUNE,) = (line for line in COMMANDS if line.startswith("smajax tune "))
(EXPORT,) = (line for line in COMMANDS if line.startswith("smajax export "))
(COMPILE,) = (line for line in COMMANDS if line.startswith("arm-none-eabi-gcc "))
(BENCH,) = (text for language, text in BLOCKS if language == "c")
(PYTHON,) = (text for language, text in BLOCKS if language == "python")

needs_cc = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler, cc, to compile the page's bench")


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def _smajax(line: str) -> None:
    """A command of the page, here."""
    told = smajax(*shlex.split(line)[1:])
    assert told.code == 0, told.said


def _compiled() -> None:
    """The page's bench.c, by its own line: the compiler of this machine, without what only the other processor has."""
    Path("bench.c").write_text(BENCH, encoding="utf-8")
    words = ["cc", *(word for word in shlex.split(COMPILE)[1:] if not word.startswith("-m"))]
    told = subprocess.run(words, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    assert {"pid.o", "bench.o"} <= {path.name for path in Path().iterdir()}


@needs_cc
def test_what_the_commands_of_the_page_export_compiles_by_its_line() -> None:
    """With the preset's gains in the place of tuned ones."""
    folder = shlex.split(TUNE)[shlex.split(TUNE).index("--out") + 1]
    Path(folder).mkdir()
    plant = build("flexinol_table_3_2", "bias_spring", "flexinol_voltage")
    gains = Gains("pid", {"proportional_gain": 900.0, "integral_gain": 500.0})
    write_gains(Path(folder, "gains.json"), gains, gains.units(plant), {})
    _smajax(EXPORT)
    _compiled()


@pytest.mark.slow  # a whole tuning
@needs_cc
def test_so_does_what_the_page_tunes() -> None:
    _smajax(TUNE)
    _smajax(EXPORT)
    _compiled()


@needs_cc
def test_what_the_python_of_the_page_exports_compiles_by_its_line() -> None:
    exec(compile(PYTHON, PAGE.name, "exec"), {"__name__": "__main__"})
    _compiled()
