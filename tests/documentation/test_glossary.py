"""Words of the package: the public names are made of the glossary's words and of plain English, and of none that were given up."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import typer

import smajax as sma
from smajax.cli.main import app
from smajax.report import json_file
from smajax.report.json_file import findings_to_json
from tests.helpers.made_findings import made_findings

ROOT = Path(__file__).parents[2]
TERM = re.compile(r"^\| ([a-z][^|]*) \| ", re.MULTILINE)

# Given up, each with the word of the field that replaces it.
GIVEN_UP = {
    "alike": "confounders, overlap",
    "aside": "superseded",
    "asked": "request",
    "begun": "start, initial_guess",
    "borne": "validated",
    "carried": "state",
    "credited": "counted",
    "foretell": "predict",
    "foretold": "predicted",
    "found": "result",
    "judge": "score, cross_validation",
    "judged": "score, cross_validation",
    "kept": "cached",
    "lane": "run, outlier_run",
    "lanes": "native, runs",
    "likeness": "overlap",
    "lone": "outlier",
    "member": "run",
    "members": "runs",
    "nobody": "null",
    "portrait": "residual_diagnostics",
    "rival": "confounder",
    "rivals": "confounders",
    "shown": "predicted, output",
    "taken": "accepted",
    "tell": "determine",
    "told": "message",
    "untold": "not_identifiable",
    "valley": "local_minimum",
    "valleys": "local_minima",
}
# Names that are still to be renamed. Take a name off the list with its rename.
ALLOWED: set[str] = set()
# Plain English in names. A word that is neither here nor in the glossary is a new term: explain it there, or choose another.
PLAIN = set(
    [
        "abstract",
        "widths",
        "actuator",
        "added",
        "after",
        "alone",
        "app",
        "no",
        "port",
        "around",
        "at",
        "average",
        "averaged",
        "band",
        "before",
        "bench",
        "bic",
        "bound",
        "budget",
        "build",
        "by",
        "cache",
        "candidate",
        "cannot",
        "check",
        "chi",
        "chosen",
        "clear",
        "close",
        "closed",
        "coefficient",
        "compiled",
        "compose",
        "contract",
        "control",
        "controller",
        "correlation",
        "count",
        "coverage",
        "data",
        "dataset",
        "decimal",
        "delay",
        "demo",
        "design",
        "deviation",
        "doctor",
        "drive",
        "dropped",
        "arithmetic",
        "export",
        "fmi",
        "to",
        "dt",
        "duration",
        "edge",
        "end",
        "equation",
        "estimator",
        "evidence",
        "excluded",
        "experiment",
        "extended",
        "fast",
        "figure",
        "filter",
        "finish",
        "folder",
        "form",
        "formula",
        "function",
        "gain",
        "get",
        "gif",
        "good",
        "grid",
        "held",
        "how",
        "identified",
        "identify",
        "in",
        "independent",
        "indistinguishable",
        "input",
        "integrated",
        "integration",
        "interval",
        "json",
        "know",
        "known",
        "largest",
        "leave",
        "limit",
        "load",
        "log",
        "loop",
        "lower",
        "mass",
        "mean",
        "measured",
        "metre",
        "mismatch",
        "model",
        "moving",
        "name",
        "named",
        "narrate",
        "new",
        "number",
        "objective",
        "odds",
        "of",
        "offset",
        "ohm",
        "one",
        "only",
        "other",
        "open",
        "out",
        "output",
        "over",
        "overwrite",
        "p",
        "parameter",
        "peer",
        "per",
        "period",
        "phase",
        "plot",
        "point",
        "position",
        "posterior",
        "predict",
        "prediction",
        "prepare",
        "probability",
        "quantum",
        "ratio",
        "reference",
        "record",
        "remaining",
        "remark",
        "report",
        "rms",
        "rmse",
        "robust",
        "role",
        "round",
        "run",
        "sample",
        "sampled",
        "scalar",
        "score",
        "seconds",
        "seed",
        "sensor",
        "sentence",
        "set",
        "settings",
        "share",
        "sigma",
        "simulate",
        "source",
        "square",
        "squared",
        "start",
        "state",
        "status",
        "step",
        "summary",
        "sweep",
        "system",
        "text",
        "the",
        "time",
        "title",
        "tolerance",
        "tried",
        "tune",
        "tuning",
        "under",
        "unexplained",
        "uncertain",
        "unit",
        "upper",
        "value",
        "variation",
        "weight",
        "whiteness",
        "why",
        "with",
        "wire",
        "without",
        "write",
        "zipped",
    ]
)


def words(name: str) -> list[str]:
    """Word parts of a name: `leave_one_out_rmse`, `--set-points`, `AbstractMovingLoad`, `WIRES`."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)
    return [word for word in re.split(r"[^a-z]+", spaced.lower()) if word]


def singular(word: str) -> str:
    return word if word.endswith("ss") else word.removesuffix("s")


def commands_and_options() -> Iterator[str]:
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        yield name
        for parameter in command.params:
            yield from (option for option in parameter.opts if option.startswith("--"))


NAMED_BY_DATA = {
    "parameters",
    "coefficients",
    "by_phase",
    "correlation",
    "provenance",
}  # their keys are names of other things


def keys(value: Any, within: str = "") -> Iterator[str]:
    """Of a JSON value, at any depth."""
    if isinstance(value, Mapping):
        for key, entry in value.items():
            if within not in NAMED_BY_DATA:
                yield str(key)
            yield from keys(entry, str(key))
    elif isinstance(value, list):
        for entry in value:
            yield from keys(entry)


def written_keys() -> Iterator[str]:
    """Keys that the writer of report.json puts down, also those that no made findings have."""
    for node in ast.walk(ast.parse(inspect.getsource(json_file))):
        if isinstance(node, ast.Dict):
            yield from (key.value for key in node.keys if isinstance(key, ast.Constant) and isinstance(key.value, str))


def public_names() -> dict[str, list[str]]:
    return {
        "import smajax as sma": sorted([*sma.NAMES, *sma.MODULES]),
        "the command line": sorted(set(commands_and_options())),
        "report.json": sorted({*keys(findings_to_json(made_findings())), *written_keys()}),
    }


PAGE = ROOT / "docs" / "start" / "glossary.md"
TERMS = [term for term in TERM.findall(PAGE.read_text(encoding="utf-8")) if term != "word"]
GLOSSARY = {word for term in TERMS for word in words(term)}


@pytest.mark.parametrize("place", public_names())
def test_no_public_name_has_a_word_that_was_given_up(place: str) -> None:
    wrong = {
        f"{name}: {word} -> {GIVEN_UP[word]}"
        for name in public_names()[place]
        if name not in ALLOWED
        for word in words(name)
        if word in GIVEN_UP
    }
    assert wrong == set()


@pytest.mark.parametrize("place", public_names())
def test_every_word_of_a_public_name_is_plain_english_or_in_the_glossary(place: str) -> None:
    known = {singular(word) for word in GLOSSARY | PLAIN | set(GIVEN_UP)}
    new = {f"{name}: {word}" for name in public_names()[place] for word in words(name) if singular(word) not in known}
    assert new == set(), "explain the word in docs/start/glossary.md, or take one that is there"


def test_the_glossary_has_each_word_once_and_each_is_used() -> None:
    assert len(TERMS) == len(set(TERMS)) > 50
    pages = [*(ROOT / "smajax").rglob("*.py"), *[one for one in (ROOT / "docs").rglob("*.md") if one != PAGE]]
    text = re.sub(r"[-_\s]+", " ", "\n".join(page.read_text(encoding="utf-8").lower() for page in pages))
    unused = [one for term in TERMS for one in term.split(", ") if one.replace("-", " ") not in text]
    assert unused == []


def test_no_exception_from_the_glossary_is_unused() -> None:
    names = {name for listed in public_names().values() for name in listed}
    assert ALLOWED - names == set(), "renamed: take them off the list"
