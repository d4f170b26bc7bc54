"""Checks that both reports of the demo exist and reach the verdict that their runs were made for."""

from __future__ import annotations

import json
import sys
from pathlib import Path

# The runs of `latent` come from a wire with latent heat, which the base model lacks; those of `complete` lack nothing.
EXPECTED: dict[str, tuple[str, list[str]]] = {"latent": ("explained", ["latent_heat"]), "complete": ("adequate", [])}


def problems(folder: Path) -> list[str]:
    """What is wrong with the demo's output, in sentences; empty when all is well."""
    found = []
    for name, (verdict, effects) in EXPECTED.items():
        if not (folder / name / "report.html").is_file():
            found.append(f"{name}: there is no report.html")
        path = folder / name / "report.json"
        if not path.is_file():
            found.append(f"{name}: there is no report.json")
            continue
        report = json.loads(path.read_text(encoding="utf-8"))
        added = [effect["name"] for effect in report["effects"] if effect["added"]]
        if (report["verdict"], added) != (verdict, effects):
            found.append(f"{name}: got {report['verdict']!r} with {added}, expected {verdict!r} with {effects}")
        else:
            print(f"{name}: {verdict}{', '.join(['', *added])}")
    return found


if __name__ == "__main__":
    wrong = problems(Path(sys.argv[1]))
    sys.exit("\n".join(wrong) if wrong else 0)
