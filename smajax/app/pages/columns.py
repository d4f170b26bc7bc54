"""The columns: what each is in the model, and its unit, begun with the guesses of the draft."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from smajax.app.drafted import columns_declared, run_files
from smajax.app.edit import edited, set_channel_values, set_channels
from smajax.app.log_files import table_of
from smajax.app.project import Project
from smajax.app.step import FieldError, Sent, Step
from smajax.data.experiment.column_guess import QUANTITIES, SURE, TIME, columns_of
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.schema import is_counted
from smajax.data.readers.table import MeasuredDataError

OUTPUTS = frozenset(["position", "angle", "force", "strain", "resistance", "temperature", "stress"])
# Units that a person may pick; any other one may be typed.
UNITS: Mapping[str, tuple[str, ...]] = {
    TIME: ("s", "ms", "min"),
    "voltage": ("V", "mV"),
    "current": ("A", "mA"),
    "power": ("W", "mW"),
    "duty": ("1", "percent"),
    "position": ("mm", "um", "m", "inch"),
    "angle": ("deg", "rad"),
    "force": ("N", "mN", "gf"),
    "mass": ("g", "kg"),
    "stress": ("MPa", "Pa"),
    "strain": ("1", "percent"),
    "temperature": ("degC", "K", "degF"),
    "ambient_temperature": ("degC", "K", "degF"),
    "resistance": ("ohm", "mohm"),
}


def outputs_of(project: Project) -> frozenset[str]:
    """Quantities that a sensor shows with the load of the experiment: a coupon's temperature is an input."""
    file = project.file
    loads = file.model.load if file else ""
    prescribed = {"coupon": {"temperature", "stress"}, "strain_coupon": {"temperature", "strain"}}
    return OUTPUTS - prescribed.get(loads, set())


def page(project: Project) -> Mapping[str, Any]:
    file = project.file
    declared = columns_declared(project)
    variables = {
        one.variable: (name, one.unit) for name, one in (file.channels if file else {}).items() if one.variable
    }
    rows: list[dict[str, Any]] = []
    seen: set[str] = set()
    for path in dict.fromkeys(path for files in run_files(project).values() for path in files):
        try:
            table = table_of(path, project.decimal)
        except (MeasuredDataError, OSError):
            continue
        for one in columns_of(table):
            if str(one.key) in seen:
                continue
            seen.add(str(one.key))
            now, unit = declared.get(one.key) or variables.get(str(one.key)) or ("", one.unit)
            guessed = now == one.quantity
            rows.append(
                {
                    "key": str(one.key),
                    "name": one.name,
                    "quantity": now,
                    "unit": unit,
                    "sure": one.sure if guessed else "",
                    "why": one.why if guessed else "your choice" if now else "left out",
                    "doubtful": guessed and one.sure != SURE and bool(now),
                    "log": path.relative_to(project.folder).as_posix() if path.is_relative_to(project.folder) else "",
                    "output": now in outputs_of(project),
                    "variable": str(one.key) in variables,
                }
            )
    return {
        "rows": rows,
        "quantities": [TIME, *QUANTITIES],
        "units": UNITS,
        "channels": file.channels if file else {},
        "clock": file.sampling.step if file and file.sampling else "",
        "counted": file is not None and is_counted(file.time),
        "offset": file.nuisance.offset if file else False,
        "others": [run for run in (file.runs if file else []) if run.columns],
    }


def save(project: Project, sent: Sent) -> str:
    if sent.action == "next":
        return "bench"
    units = {str(row["key"]): str(row["unit"]) for row in page(project)["rows"]}
    fields = {
        field.removeprefix("column."): value for field, value in sent.values.items() if field.startswith("column.")
    }
    if unknown := next((one for one in fields if one not in units), None):
        raise FieldError("", f"there is no column {unknown!r} any more; load the page again")

    def change(document: Any) -> None:
        set_channels(document, sent.values, outputs_of(project), units)
        set_channel_values(document, sent.values)

    try:
        edited(project.path, change)
    except ExperimentError as error:
        raise FieldError("", str(error)) from None
    return ""


STEP = Step(
    "columns", "Columns", page, save, keys=("channels", "time", "sampling"), needs="experiment", to_look_at=True
)
