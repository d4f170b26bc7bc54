"""Tuning: the gains of a controller on the fitted model."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from smajax.app.edit import ON
from smajax.app.log_files import stamp
from smajax.app.pages.fit import begin, out_name, watch
from smajax.app.pages.predict import chosen_model, models
from smajax.app.project import Project
from smajax.app.ready import ready
from smajax.app.step import FieldError, Sent, Step
from smajax.core.display_units import digits


@lru_cache(maxsize=8)
def _able(at: tuple[str, int, int]) -> tuple[tuple[str, ...], str, str]:
    """(controllers that this model can have, the unit of set points, why there are none)."""
    ready()
    from smajax.control.model_as_plant import plant_of
    from smajax.control.position_unit import default_set_points, unit_of
    from smajax.control.presets import controllers_for
    from smajax.data.experiment.errors import ExperimentError
    from smajax.data.model_file.read import load_model

    try:
        kept = load_model(Path(at[0]))
        system, _ = plant_of(kept)
        unit = unit_of(system)
        points = ",".join(f"{one:.3g}" for one in default_set_points(system, 3))
        return tuple(controllers_for(system)), f"{unit.shown}; default {points}", ""
    except (ExperimentError, KeyError, ValueError) as error:
        return (), "", str(error.args[0])


def _gain_rows(record: Mapping[str, Any]) -> list[dict[str, str]]:
    """Each gain before and after, with its unit; none of a record without numbers."""
    rows = []
    for name, one in record.get("gains", {}).items():
        before, after = (digits(one.get(key), 4) for key in ("before", "after"))
        rows.append({"name": name, "before": before, "after": after, "unit": one.get("unit", "")})
    return rows


def page(project: Project) -> Mapping[str, Any]:
    there = models(project)
    able, unit, why = _able(stamp(project.folder / there[0])) if there else ((), "", "")
    found = []
    for one in project.results:
        if one.command == "tune":
            record = project.record_of(one)
            found.append({"result": one, "headline": record.get("headline", ""), "gains": _gain_rows(record)})
    return {
        "models": there,
        "controllers": able,
        "unit": unit,
        "why_not": why,
        "shown": found,
        **watch(project, ("tune",)),
    }


def save(project: Project, sent: Sent) -> str:
    model = chosen_model(project, sent)
    controller = sent.values.get("controller", "")
    if not controller.isidentifier():
        raise FieldError("controller", "choose a controller")
    words = [controller, "--model", model]
    if points := sent.values.get("points", "").strip():
        words.append(f"--set-points={points}")
    if sent.values.get("fast") == ON:
        words.append("--fast")
    if sent.values.get("overwrite") == ON:
        words.append("--overwrite")
    begin(project, "tune", words, out_name(sent, f"tuned-{controller}"), {})
    return ""


STEP = Step("tune", "Tune", page, save, needs="model", done=lambda project: project.result("tune") is not None)
