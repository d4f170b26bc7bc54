"""A peer's answer to a case, stored whole or not at all, and its comparison with the truth, made as for the loop."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from smajax.core.files import json_text, replace
from studies.attribution_benchmark.judge import Judged, asked_and_strength, equations_of, kind_of, names_of


@dataclass(frozen=True)
class Answer:
    """Errors are rms over the noise, each run's best zero off. `reason`: why there is no answer."""

    peer: str
    case: str
    added: tuple[str, ...] = ()  # effects of the library by name, in the order in which they were found
    where: tuple[str, ...] = ()  # equations named, the strongest first
    adequate: bool | None = None  # whether it says that nothing is missing; None: it does not say
    fit_error: float = float("nan")
    held_out_error: float = float("nan")
    seconds: float = float("nan")
    said: str = ""  # formula, settings
    values: dict[str, float] | None = None  # parameters by name, where it has any of the model's
    reason: str = ""


def save(one: Answer, path: Path) -> None:
    """Whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    replace(path, json_text(asdict(one)))


def load(path: Path) -> Answer:
    """One that `save` wrote."""
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    for name in ("added", "where"):
        record[name] = tuple(record[name])
    for name in ("fit_error", "held_out_error", "seconds"):
        record[name] = float("nan") if record[name] is None else record[name]
    return Answer(**record)


def verdict(one: Answer) -> str:
    """In the loop's words, or none."""
    if one.adequate is None:
        return "none"
    return "adequate" if one.adequate else "explained" if one.added else "not in the library"


def judged(truth: Mapping[str, Any], one: Answer, base: Answer) -> Judged:
    """`one` beside the truth; `base`: the refitted base model's answer."""
    asked, strength = asked_and_strength(truth, base.fit_error)
    return Judged(
        case=truth["case"],
        kind=kind_of(truth),
        rig=truth["rig"],
        asked=asked,
        strength=strength,
        truth=names_of(truth),
        equations=equations_of(truth),
        verdict=verdict(one),
        added=one.added,
        named=one.added,
        where=one.where,
        fit_before=base.fit_error,
        fit_after=one.fit_error,
        held_out_before=base.held_out_error,
        held_out_after=one.held_out_error,
        seconds=one.seconds,
    )
