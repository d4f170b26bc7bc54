"""What the documentation shows: its code runs and prints what it says it prints, and the site builds without a warning."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import re
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import pytest

import smajax
from smajax import __version__
from smajax.control.presets import CONTROLLERS
from smajax.core.parameters import parameters
from smajax.model.effects.library import LIBRARY, of_others
from smajax.model.presets import LOADS
from tests.helpers.often import often

ROOT = Path(__file__).parents[2]
LOADS_PAGE = ROOT / "docs" / "reference" / "loads-and-drives.md"
PAGES = [*sorted((ROOT / "docs" / "how-to").glob("*.md")), LOADS_PAGE, ROOT / "CONTRIBUTING.md"]
FENCE = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```\n(?:\n^```text\n(.*?)^```\n)?', re.MULTILINE | re.DOTALL)
SLOW = "found = identify("  # blocks of the slow tests only
LONG = ("control-your-bench", "on-a-gpu")  # pages that take seconds: in the slow tests
LINES = 20  # of code a page shows in a row, imports aside


def blocks(page: Path) -> list[tuple[str, str, str, str]]:
    """(language, file name or nothing, text, what it prints or nothing) of each fenced block."""
    return FENCE.findall(page.read_text(encoding="utf-8"))


def run(page: Path, folder: Path, only: str = "", without: str = "\0") -> None:
    """Python blocks of a page in order, in one namespace; blocks with a file name are written first.

    Of the blocks those that hold `only` and not `without`.
    """
    names: dict[str, object] = {"__name__": "__main__"}
    with patch.dict(CONTROLLERS), patch.dict(LIBRARY):  # what a page registers is there on that page alone
        for language, name, text, shown in blocks(page):
            if name:
                (folder / name).write_text(text, encoding="utf-8")
            if language != "python" or only not in text or without in text:
                continue
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(text, f"{page.name}: {text.splitlines()[0]}", "exec"), names)
            if shown:
                assert printed.getvalue() == shown, page.name


@pytest.mark.parametrize(
    "page", often(PAGES, [page for page in PAGES if page.stem not in LONG]), ids=lambda page: page.stem
)
def test_the_code_of_a_page_runs_and_prints_the_output_shown(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run(page, tmp_path, without=SLOW)


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [page for page in PAGES if SLOW in page.read_text(encoding="utf-8")], ids=lambda page: page.stem
)
def test_a_page_with_a_fit_runs_to_its_end(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(page, tmp_path)


def test_the_page_of_the_loads_has_the_equation_and_the_parameters_of_each() -> None:
    text = LOADS_PAGE.read_text(encoding="utf-8")
    own = {"arm", "dead_weight", "bias_spring", "blocked_wire", "coupon", "strain_coupon"}
    assert own <= set(LOADS)
    for name in own:
        assert f"| `{name}`" in text
        for parameter in parameters(LOADS[name]()):
            assert f"`{parameter}`" in text, (name, parameter)


def test_the_first_example_of_the_readme_prints_the_output_shown(tmp_path: Path) -> None:
    run(ROOT / "README.md", tmp_path, only="np.full(2001, 8.0)")


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))], ids=lambda page: str(page.relative_to(ROOT))
)
def test_an_example_that_begins_says_the_precision(page: Path) -> None:
    """In the single precision of JAX's default a fit is an error and a simulation loses half of its digits."""
    begun = [text for language, _, text, _ in blocks(page) if language == "python" and "import smajax as sma" in text]
    assert not begun or "prepare()" in begun[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "only"),
    [
        ("docs/reference/control.md", "simulate_closed_loop"),
        ("docs/reference/batches.md", "run_batch"),
    ],
)
def test_the_other_examples_of_the_readme_and_the_reference_run(page: str, only: str, tmp_path: Path) -> None:
    run(ROOT / page, tmp_path, only)


def test_the_readme_is_short_and_leads_to_what_it_leaves_out() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 120
    for target, anchor in re.findall(r"\]\((docs/[^)#\s]+)#([^)\s]+)\)", text):
        titles = re.findall(r"^#+ (.*)$", (ROOT / target).read_text(encoding="utf-8"), re.MULTILINE)
        assert anchor in [title.lower().replace(".", "").replace(" ", "-") for title in titles], (target, anchor)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_no_page_shows_more_than_twenty_lines_in_a_row(page: Path) -> None:
    for _, _, text, _ in (block for block in blocks(page) if block[0] == "python"):
        code = [
            line
            for line in text.splitlines()
            if line.strip() and not line.startswith(("import ", "from ", "sma.prepare"))
        ]
        assert len(code) <= LINES, text


def test_the_reference_names_no_module_that_is_gone() -> None:
    for page in (ROOT / "docs" / "reference").glob("*.md"):
        for name in re.findall(r"^::: smajax\.(\S+)$", page.read_text(encoding="utf-8"), re.MULTILINE):
            place = ROOT / "smajax" / name.replace(".", "/")
            assert place.is_dir() or place.with_suffix(".py").is_file(), f"{page.name}: {name}"


def test_the_reference_has_every_public_name_and_every_effect_of_the_package() -> None:
    """`python -m studies.make_reference` writes the pages anew."""
    from studies.make_reference import FOLDER, PAGES

    for page, make in PAGES.items():
        assert (FOLDER / page).read_text(encoding="utf-8") == make(), page
    told = (FOLDER / "names.md").read_text(encoding="utf-8")
    assert [name for name in (*smajax.NAMES, *smajax.MODULES) if told.count(f"\n| [`{name}`](") != 1] == []
    told = (FOLDER / "effects.md").read_text(encoding="utf-8")
    assert [name for name in LIBRARY.keys() - of_others().keys() if told.count(f"\n| [`{name}`](") != 1] == []


def test_every_link_of_a_page_leads_to_a_file() -> None:
    pages = [ROOT / "README.md", *PAGES, *(ROOT / "docs").rglob("*.md"), *(ROOT / "studies").rglob("*.md")]
    lost = [
        f"{page.relative_to(ROOT)}: {target}"
        for page in pages
        for target in re.findall(
            r"\]\(([^)#\s]+)", re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        )
        if "://" not in target and not (page.parent / target).exists()
    ]
    assert lost == []


def test_every_link_of_a_page_that_a_command_wrote_leads_to_a_file() -> None:
    for page in (ROOT / "studies").rglob("*.html"):
        linked = re.findall(r'(?:href|src)="([^"#]+)"', page.read_text(encoding="utf-8"))
        lost = [one for one in linked if not one.startswith(("http", "data:")) and not (page.parent / one).exists()]
        assert lost == [], page


def test_every_page_is_in_the_sites_list() -> None:
    listed = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    docs = ROOT / "docs"
    assert [page.name for page in docs.rglob("*.md") if page.relative_to(docs).as_posix() not in listed] == []


def test_the_citation_file_has_this_version() -> None:
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    if importlib.util.find_spec("mkdocs") is None:
        pytest.skip("mkdocs is not installed: pip install -e '.[docs]'")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "site" / "reference" / "wire.html").read_text(encoding="utf-8")
    assert "<math" in page
    assert "arithmatex" not in page
