"""Checks that both reports of the demo exist and reach the verdict that their runs were made for.

With a second folder: of those that are there, and that their numbers are those of the demo that lies in it, made by another Python or
engine.
"""

from __future__ import annotations

import json
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

DEMO = Path(__file__).parents[1] / "smajax" / "data" / "demo"

# The runs of `latent` come from a wire with latent heat, which the base model lacks; those of `complete` lack nothing.
EXPECTED: dict[str, tuple[str, list[str]]] = {"latent": ("explained", ["latent_heat"]), "complete": ("adequate", [])}


SAME, NOTHING = 1e-6, 1e-11  # of a number; what is below the second is zero but for rounding
OWN = ("provenance", "version", "seconds", "created")  # what may differ between two demos


def _numbers(told: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Every entry of a report by its place in it."""
    if isinstance(told, dict):
        for key, value in told.items():
            yield from () if key in OWN else _numbers(value, f"{place}/{key}")
    elif isinstance(told, list):
        for number, value in enumerate(told):
            yield from _numbers(value, f"{place}/{number}")
    else:
        yield place, told


def differences(folder: Path, other: Path) -> list[str]:
    """Where two demos differ by more than rounding."""
    found = []
    for name in _made(folder):
        one, two = (
            dict(_numbers(json.loads((at / name / "report.json").read_text("utf-8")))) for at in (folder, other)
        )
        if set(one) != set(two):
            found.append(f"{name}: {sorted(set(one) ^ set(two))[:5]} are in one report alone")
        for place in sorted(set(one) & set(two)):
            a, b = one[place], two[place]
            if isinstance(a, float) and isinstance(b, float):
                scale = 1.0 if "/correlation/" in place else max(abs(a), abs(b))  # a correlation's own is one
                if abs(a - b) > max(SAME * scale, NOTHING):
                    found.append(f"{name}{place}: {a!r} here and {b!r} there")
            elif a != b:
                found.append(f"{name}{place}: {a!r} here and {b!r} there")
    return found


def _made(folder: Path) -> list[str]:
    return [name for name in EXPECTED if (folder / name).is_dir()]


def problems(folder: Path, names: Sequence[str]) -> list[str]:
    """What is wrong with the demo's output, in sentences; empty when all is well."""
    found = [] if names else [f"{folder} holds no report"]
    for name in names:
        verdict, effects = EXPECTED[name]
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
    wrong = problems(Path(sys.argv[1]), list(EXPECTED) if len(sys.argv) == 2 else _made(Path(sys.argv[1])))
    if len(sys.argv) > 2 and not wrong:
        wrong = differences(Path(sys.argv[1]), Path(sys.argv[2]))
        print("the same numbers as the other demo" if not wrong else f"{len(wrong)} numbers differ")
    sys.exit("\n".join(wrong) if wrong else 0)
