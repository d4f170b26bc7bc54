"""Write studies/parameters.md from the presets themselves: `python -m studies.make_docs`."""

from __future__ import annotations

from pathlib import Path

from smajax.origins import ORIGINS
from smajax.parameters import get_parameters, parameters
from smajax.presets import DRIVES, LOADS, WIRES
from smajax.report.display import digits
from smajax.runtime import prepare
from smajax.wire.laws import LAWS, detwinning

PAGE = Path(__file__).parent / "parameters.md"


def page() -> str:
    """The Markdown text."""
    lines = [
        "# Parameters of the presets",
        "",
        "Made from the presets by `python -m studies.make_docs`; do not edit. SI, temperatures in degrees Celsius, angles in",
        "radians. *printed*: as the source (Elahinia 2004) has it; *corrected*: the source's number in other units or",
        "mended; *chosen*: the source is silent, and this is what smajax takes.",
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
            values = get_parameters(part, list(table))
            for value, entry in zip(values, table.values(), strict=True):
                origin = ORIGINS[name][entry.name]
                lines.append(
                    f"| `{entry.name}` | {digits(float(value), 5)} | {entry.unit} | {digits(entry.low)} to "
                    f"{digits(entry.high)} | {origin.kind}: {origin.note} | {entry.about} |"
                )
    lines += ["", "## Kinetics laws", "", "| law | shape | conditions | variants | source |", "|---|---|---|---|---|"]
    for name, law in LAWS.items():
        parts = (type(law.shape).__name__, type(law.conditions).__name__, type(law.variants()).__name__)
        lines.append(f"| `{name}` | {' | '.join(parts)} | {law.source} |")
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
