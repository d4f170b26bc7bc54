"""`report.json` is strict JSON and holds the record; the keys and names of version 0.1 are read with a warning."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from smajax.attribution.findings import Findings
from smajax.report.json_file import RENAMED, findings_to_json, with_current_keys
from smajax.report.narrative import narrate
from tests.helpers.made_findings import NAN, NOISE
from tests.helpers.report_page import made_unknown_term


def test_json_is_strict_and_holds_the_record(findings, folder):
    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is not JSON")

    read = json.loads((folder / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)
    assert read == findings_to_json(findings)
    assert read["verdict"] == "explained"
    assert read["output"] == {
        "name": "position",
        "unit": "m",
        "noise_sigma": NOISE,
        "noise_how": "estimated from the flat part of the runs",
    }
    assert [run["rmse_before"] for run in read["runs"]] == [run.rmse_before for run in findings.runs]
    assert read["runs"][2]["role"] == "held-out"
    assert read["runs"][2]["samples"] == 1200
    assert read["before"]["parameters"]["stress_slope_austenite"]["standard_error"] is None
    assert read["after"]["parameters"]["latent_heat.enthalpy"]["value"] == 24187.3
    latent = next(effect for effect in read["effects"] if effect["added"])
    assert latent["name"] == "latent_heat"
    assert latent["coefficients"]["enthalpy"] == {
        "value": 24187.3,
        "standard_error": 210.6,
        "unit": "J/kg",
        "interval_over_runs": None,
    }


def test_nan_and_infinity_are_null(findings):
    run = dataclasses.replace(findings.runs[0], rmse_after=float("inf"), offset_after=NAN)
    read = findings_to_json(dataclasses.replace(findings, runs=(run,)))
    assert read["runs"][0]["rmse_after"] is None
    assert read["runs"][0]["offset_after"] is None
    assert read["effects"][2]["evidence"]["alone_rmse_fit"] is None


def test_numpy_scalars_are_plain_numbers_and_arrays_lists(findings):
    run = dataclasses.replace(findings.runs[0], rmse_after=np.float32(0.5))
    assert findings_to_json(dataclasses.replace(findings, runs=(run,)))["runs"][0]["rmse_after"] == 0.5


def test_a_record_with_old_keys_is_read_with_a_warning(findings: Findings) -> None:
    """Until version 0.2, with a warning for each."""
    new = findings_to_json(dataclasses.replace(findings, unknown=(made_unknown_term("unknown_a", True),)))
    back = {now: key for (place, key), now in RENAMED.items() if not place}
    old = {back.get(key, key): value for key, value in new.items()}
    old["unknown"] = [
        {"alike" if key == "indistinguishable" else key: value for key, value in one.items()} for one in new["unknown"]
    ]
    with pytest.warns(DeprecationWarning, match=r"portrait_before \(residual_before now\).*unknown.alike"):
        assert with_current_keys(old) == new
    assert with_current_keys(new) == new


def test_old_names_are_read_with_a_warning(findings: Findings) -> None:
    with pytest.warns(DeprecationWarning, match="residual_after"):
        assert findings.portrait_after is findings.residual_after
    with pytest.warns(DeprecationWarning, match="narrate"):
        assert findings.summary == narrate(findings).summary
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = findings.nothing
