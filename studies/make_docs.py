"""Write studies/parameters.md and parameters_of_controllers.md from the presets themselves: `python -m studies.make_docs`."""

from __future__ import annotations

from pathlib import Path

from smajax.control.presets import CONTROLLERS, adaptive_filter, model_filter, printed_filter
from smajax.core.display_units import digits
from smajax.core.parameters import get_parameters, parameters
from smajax.core.runtime import prepare
from smajax.model.preset_sources import origins_of
from smajax.model.presets import DRIVES, LOADS, WIRES
from smajax.model.rigs import arm
from smajax.model.wire.laws import LAWS, detwinning

BELIEVED = ("equation", "believed", "system")  # fields that hold a plant
PAGE = Path(__file__).parent / "parameters.md"
OTHER = Path(__file__).parent / "parameters_of_controllers.md"


def page() -> str:
    """The Markdown text."""
    lines = [
        "# Parameters of the presets",
        "",
        "Made from the presets by `python -m studies.make_docs`; do not edit. SI, temperatures in degrees Celsius, angles in",
        "radians. *printed*: as the source (Elahinia 2004) has it; *corrected*: the source's number in other units or",
        "mended; *chosen*: the source is silent, and this is what smajax takes.",
        "[Controllers, filters and kinetics laws](parameters_of_controllers.md).",
    ]
    for kind, presets in (("Wires", WIRES), ("Loads", LOADS), ("Drives", DRIVES)):
        lines += ["", f"## {kind}"]
        for name, preset in presets.items():
            part = preset()
            about = (preset.__doc__ or "").strip().split("\n\n")[0].replace("\n", " ")
            lines += ["", f"### `{name}`", "", " ".join(about.split())]
            table = parameters(part)
            if not table:
                continue
            lines += ["", "| parameter | value | unit | bounds | where from | meaning |", "|---|---|---|---|---|---|"]
            values, origins = get_parameters(part, list(table)), origins_of(name, part)
            for value, entry in zip(values, table.values(), strict=True):
                origin = origins[entry.name]
                lines.append(
                    f"| `{entry.name}` | {digits(float(value), 5)} | {entry.unit} | {digits(entry.low)} to "
                    f"{digits(entry.high)} | {origin.kind}: {origin.note} | {entry.about} |"
                )
    return "\n".join(lines) + "\n"


def page_of_controllers() -> str:
    """The Markdown text."""
    lines = [
        "# Parameters of controllers, filters and kinetics laws",
        "",
        "Made from the presets by `python -m studies.make_docs`; do not edit. SI, temperatures in degrees Celsius, angles in radians.",
        "[Wires, loads and drives](parameters.md).",
        "",
        "## Controllers and filters",
        "",
        "Of the arm (`control/presets.py`). The source prints 10 V and 4 V, P_0, Q and the filter's first guess; gains come",
        "from the searches in `studies/gains`. What a controller believes of its plant is the plant's own table.",
    ]
    system = arm()
    shown = {name: preset.on_arm for name, preset in CONTROLLERS.items()}
    filters = {"printed filter": printed_filter, "model filter": model_filter, "adaptive filter": adaptive_filter}
    for name, make in {**shown, **filters}.items():
        one = make(system)
        about = (make.__doc__ or "").strip().split("\n\n")[0]
        lines += ["", f"### `{name}`", "", " ".join(about.split()), ""]
        lines += ["| gain | value | unit | bounds | meaning |", "|---|---|---|---|---|"]
        own = {key: entry for key, entry in parameters(one).items() if not {*entry.path} & {*BELIEVED}}
        for value, entry in zip(get_parameters(one, list(own)), own.values(), strict=True):
            bounds = f"{digits(entry.low)} to {digits(entry.high)}"
            lines.append(f"| `{entry.name}` | {digits(float(value), 3)} | {entry.unit} | {bounds} | {entry.about} |")
    lines += ["", "## Kinetics laws", "", "| law | shape | conditions | variants | source |", "|---|---|---|---|---|"]
    for name, law in LAWS.items():
        parts = (type(law.shape).__name__, type(law.conditions).__name__, type(law.variants()).__name__)
        lines.append(f"| `{name}` | {' | '.join(parts)} | {law.source} |")
    lines += [
        "",
        "`integrated` has the integrated form of the constitutive law too (eq. 4.51); under the others it is the wire's, in rates.",
    ]
    split = detwinning()
    start, finish = (float(value) / 1e6 for value in get_parameters(split, list(parameters(split))))
    lines += [
        "",
        f"Brinson's critical stresses are {start:g} and {finish:g} MPa, chosen: the source prints none and calls 41.6 MPa "
        '"enough to elongate the wire to fully detwinned martensite" (sec. 3.5.1).',
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    prepare()
    PAGE.write_text(page(), encoding="utf-8")
    OTHER.write_text(page_of_controllers(), encoding="utf-8")
