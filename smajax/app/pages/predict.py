"""Prediction: the fitted model against other logs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from smajax.app.confined import OutsideError
from smajax.app.pages.fit import COMMANDS, begin, out_name, watch
from smajax.app.pages.result import shown
from smajax.app.project import Project
from smajax.app.step import FieldError, Sent, Step


def models(project: Project) -> list[str]:
    """Model files of the results, the newest fit first."""
    newest = project.result(*COMMANDS)
    several = [one for one in project.results if (project.folder / one.folder / "model.toml").is_file()]
    several.sort(key=lambda one: one is not newest)
    return [f"{one.folder}/model.toml" for one in several]


def chosen_model(project: Project, sent: Sent) -> str:
    """The model file that a form names. Raises FieldError."""
    there = models(project)
    name = sent.values.get("model") or (there[0] if there else "")
    if name not in there:
        raise FieldError(
            "model", "there is no fitted model yet: fit one first" if not there else f"there is no {name!r}"
        )
    return name


def page(project: Project) -> Mapping[str, Any]:
    return {
        "models": models(project),
        "shown": [shown(project, one) for one in project.results if one.command == "predict"],
        **watch(project, ("predict",)),
    }


def save(project: Project, sent: Sent) -> str:
    model = chosen_model(project, sent)
    logs = list(sent.several.get("log", ()))
    if not logs:
        raise FieldError("log", "tick at least one log")
    for own in logs:
        try:
            project.log_at(own)
        except OutsideError as error:
            raise FieldError("log", str(error)) from None
    words = [model, *(f"./{own}" for own in logs)]  # a name that begins with a dash is no option
    if given := sent.values.get("inputs", "").strip():
        words.append(f"--input={given}")
    if given := sent.values.get("values", "").strip():
        words.append(f"--set={given}")
    begin(project, "predict", [*words, "--overwrite"], out_name(sent, "predicted"), {})
    return ""


STEP = Step("predict", "Predict", page, save, needs="model", done=lambda project: project.result("predict") is not None)
