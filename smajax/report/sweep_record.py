"""A sweep as a record for machines: `sweep.json`."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from smajax.control.least_time import Distance
from smajax.control.sweep.least_times import LeastTimes
from smajax.control.sweep.run_sweep import ControllerSweep, SweepResults
from smajax.core.provenance import made_with
from smajax.report.sweep_numbers import comparison_digest, digest_of, lines_digest, map_numbers, nominal_gain
from smajax.report.sweep_page import NO_REMARKS, Remarks, answer, conclusions


def as_json(results: SweepResults, command: str = "", remarks: Remarks = NO_REMARKS) -> str:
    """The comparison and the grid, SI; infinite times are null."""
    settings, grid, own = results.settings, results.grid, results.unit.own

    def plain(values: np.ndarray) -> list[float | None]:
        return [float(value) if np.isfinite(value) else None for value in np.asarray(values).ravel()]

    batch = grid.plants.batch
    record: dict[str, Any] = {
        "headline": answer(results),
        "conclusions": conclusions(results),
        "between": settings.between,
        "notes": list(remarks.notes),
        "settings": list(remarks.settings),
        f"set_points_{own}": plain(grid.targets),
        "controllers": {
            name: {field.name: plain(getattr(one, field.name)) for field in dataclasses.fields(one)}
            for name, one in results.nominal.items()
        },
        "least_times": {one.name: _least_times(one, plain) for one in results.sweeps},
        "sweep": {
            "mismatches": list(grid.mismatches),
            **(
                {
                    "plants": dict(zip(grid.plants.columns, map(plain, batch.T), strict=True)),
                    "assumed": dict(zip(grid.plants.columns, plain(grid.plants.nominal), strict=True)),
                    "units": dict(zip(grid.plants.columns, grid.plants.units, strict=True)),
                }
                if batch is not None
                else {"ratios": plain(grid.ratios)}
            ),
            "maps": {one.name: map_numbers(grid, one) for one in results.sweeps},
            f"set_points_{own}": plain(grid.targets),
            "gain_ratios": plain(grid.gains),
            "loops": grid.size,
            "failed": {one.name: int(np.isfinite(one.failed_at).sum()) for one in results.sweeps},
            "settling_over_least_time": {
                one.name: {
                    of: _as_record(one.distance_at(nominal_gain(grid), least)) for of, least in _both(one).items()
                }
                for one in results.sweeps
            },
        },
        "integration_error": {one.name: one.integration_error for one in results.sweeps},
        "command": command,
        "made_with": made_with(),
    }
    record["pictures"] = picture_digests(record, results.sweeps)
    return _in_lines(json.dumps(record, indent=2)) + "\n"


def picture_digests(record: Mapping[str, Any], sweeps: Sequence[ControllerSweep]) -> dict[str, str]:
    """File name -> digest of the numbers that the picture draws; the picture has it too, as the text `sweep_numbers.IN_PICTURE`."""
    maps = record["sweep"]["maps"]
    return {
        "comparison.png": comparison_digest(record),
        **{f"{name}_maps.png": digest_of(numbers) for name, numbers in maps.items()},
        **{f"{one.name}_lines.png": lines_digest(one) for one in sweeps if one.lines},
    }


def _in_lines(text: str) -> str:
    """Lists of numbers in one line each."""
    return re.sub(
        r"\[[^\[\]{}\"]*\]", lambda one: re.sub(r"\s+", " ", one[0]).replace("[ ", "[").replace(" ]", "]"), text
    )


def _as_record(found: Distance | None) -> dict[str, float | None] | None:
    """null where the command has no limit; median and worst are null where no run settles."""
    if found is None:
        return None
    return {name: one if np.isfinite(one) else None for name, one in found._asdict().items()}


def _least_times(sweep: ControllerSweep, plain: Callable[[np.ndarray], list[float | None]]) -> dict[str, Any]:
    """With either largest command, of the unperturbed plant at every set point; null: out of reach, or of a command without a limit."""
    return {
        name: {
            "largest_command": least.limit if np.isfinite(least.limit) else None,
            "seconds": plain(least.nominal),
            "settling_over_least_time": _as_record(sweep.nominal_distance(least)),
        }
        for name, least in _both(sweep).items()
    }


def _both(sweep: ControllerSweep) -> dict[str, LeastTimes]:
    """By whose largest command it is."""
    return {"all_controllers": sweep.least, "controller": sweep.own_least}
