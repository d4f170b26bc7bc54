"""Checks that both reports of the demo exist and reach the verdict that their runs were made for."""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path
from typing import Any

DEMO = Path(__file__).parents[1] / "smajax" / "demo"

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
        found += [f"{name}: {line}" for line in _off(report, name)]
    return found


def _off(report: dict[str, Any], name: str) -> list[str]:
    """Values more than 3 % from the truth behind the runs, and held-out errors above 1.1 times the noise."""
    truth = tomllib.loads((DEMO / name / "truth.toml").read_text(encoding="utf-8"))["parameters"]
    told = {parameter: entry["value"] for parameter, entry in report["after"]["parameters"].items()}
    told |= {"latent_heat": told.pop("latent_heat.enthalpy")} if "latent_heat.enthalpy" in told else {}
    wrong = [
        f"{parameter} is {value:.5g}, the runs were made with {truth[parameter]:.5g}"
        for parameter, value in told.items()
        if parameter in truth and abs(value - truth[parameter]) > 0.03 * abs(truth[parameter])
    ]
    noise = report["output"]["noise_sigma"]
    wrong += [
        f"{run['name']} is off by {run['rmse_after'] / noise:.2f} times the noise"
        for run in report["runs"]
        if run["role"] == "held-out" and run["rmse_after"] > 1.1 * noise
    ]
    return wrong


if __name__ == "__main__":
    wrong = problems(Path(sys.argv[1]))
    sys.exit("\n".join(wrong) if wrong else 0)
