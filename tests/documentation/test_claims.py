"""Every claim of docs/claims.md and docs/robustness.md keeps a test or a study that holds it."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
ROOT = DOCS.parent
LINK = re.compile(r"\]\(([^)#\s]+)[^)]*\)")


def rows(page: str) -> list[str]:
    """Of all tables of a page, without their headings."""
    lines = (DOCS / page).read_text(encoding="utf-8").splitlines()
    return [
        line
        for line, above in zip(lines[2:], lines[1:], strict=False)
        if line.startswith("| ") and above.startswith("|") and not line.startswith("|---")
    ]


def links(text: str) -> list[Path]:
    return [(DOCS / target).resolve() for target in LINK.findall(text) if "://" not in target]


def functions_of(path: Path) -> list[str]:
    return [
        node.name
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    ]


def test_every_claim_links_what_holds_it() -> None:
    text = (DOCS / "claims.md").read_text(encoding="utf-8")
    holds = text[text.index("## What holds") : text.index("## What does not hold")]
    claims = [line for line in holds.splitlines() if line.startswith("| ") and "| held by |" not in line]
    assert len(claims) >= 35, "a claim was dropped: say in the changelog why"
    assert [line for line in claims if not links(line.rsplit(" | ", 1)[1])] == []


@pytest.mark.parametrize("page", ["claims.md", "robustness.md"])
def test_every_linked_test_file_has_tests(page: str) -> None:
    files = {path for path in links((DOCS / page).read_text(encoding="utf-8")) if ROOT / "tests" in path.parents}
    assert len(files) >= 15
    assert [path for path in sorted(files) if not path.is_file()] == []
    assert [path for path in sorted(files) if not path.name.startswith("test_") or not functions_of(path)] == []


def test_every_row_of_the_robustness_tests_names_its_test() -> None:
    for line in rows("robustness.md"):
        cell = line.rstrip(" |").rsplit(" | ", 1)[1]
        assert links(cell) or cell.startswith("same"), line
