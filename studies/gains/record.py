"""What a search for gains was and what it found -> a JSON file beside its script."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from smajax.gain_search import Found

HERE = Path(__file__).parent


def rounded(gains: Mapping[str, float]) -> dict[str, float]:
    """Gains to two digits: what a preset uses."""
    return {name: float(f"{value:.2g}") for name, value in gains.items()}


def write(
    name: str, found: Found, box: Mapping[str, tuple[float, float]], targets: Sequence[float], **said: Any
) -> None:
    """Print the search and write it to `name`.json; `targets` in degrees, `said` is what else belongs to it."""
    merits = {
        "settling_time_s": found.merits.settling_time,
        "overshoot_deg": np.degrees(found.merits.overshoot),
        "steady_error_deg": np.degrees(found.merits.steady_error),
    }
    record = {
        "box": {gain: list(bounds) for gain, bounds in box.items()},
        "targets_deg": list(targets),
        **said,
        "tried": found.tried,
        "cost": round(found.cost, 3),
        "found": found.gains,
        "gains": rounded(found.gains),
        "by_target": {key: [round(float(value), 3) for value in values] for key, values in merits.items()},
    }
    text = json.dumps(record, indent=2)
    print(text)
    (HERE / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def read(name: str) -> dict[str, Any]:
    """The record of a search. OSError when it was never made."""
    record: dict[str, Any] = json.loads((HERE / f"{name}.json").read_text(encoding="utf-8"))
    return record
