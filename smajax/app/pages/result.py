"""The result: verdict, errors before and after, and the page of the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from smajax.app.log_files import stamp
from smajax.app.pages.fit import COMMANDS
from smajax.app.project import Project, Result
from smajax.app.step import Step
from smajax.core.display_units import digits, display
from smajax.core.wording import verdict_text

TONES = {"adequate": "good", "explained": "good", "partly explained": "fair"}


def _runs(record: Mapping[str, Any]) -> list[dict[str, str]]:
    output = record.get("output")
    unit = display(output["unit"], output["name"]) if isinstance(output, dict) else display("")
    rows = []
    for run in record.get("runs", ()):
        before, after = (
            unit.of(run[key]) if isinstance(run.get(key), float) else None for key in ("rmse_before", "rmse_after")
        )
        rows.append(
            {
                "name": run["name"],
                "role": run["role"],
                "before": f"{digits(before, 3)} {unit.unit}",
                "after": f"{digits(after, 3)} {unit.unit}",
            }
        )
    return rows


def shown(project: Project, result: Result) -> dict[str, Any]:
    """What the page says of one result folder."""
    record = project.record_of(result)
    at_bounds = [*(record.get("coefficients_at_bounds") or []), *(record.get("unknowns_at_bounds") or [])]
    why = record.get("held_out_runs", "")
    return {
        "result": result,
        "title": record.get("title", ""),
        "verdict": verdict_text(record.get("verdict", ""), at_bounds, doubt=why),
        "tone": "fair" if at_bounds or why else TONES.get(record.get("verdict", ""), "plain"),
        "remaining": record.get("remaining", ""),
        "sentences": record.get("summary") or record.get("conclusions") or [],
        "runs": _runs(record) if result.command == "close-loop" else [],
        "model": (project.folder / result.folder / "model.toml").is_file(),
    }


def page(project: Project) -> Mapping[str, Any]:
    several = [one for one in project.results if one.command in COMMANDS]
    several.sort(key=lambda one: stamp(project.folder / one.folder / one.page)[1], reverse=True)
    return {"shown": [shown(project, one) for one in several]}


def done(project: Project) -> bool:
    return project.result(*COMMANDS) is not None


STEP = Step("result", "Result", page, done=done, light=True, to_look_at=True)
