"""The presets carry the gains that their searches recorded."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from smajax.control import presets as presets
from smajax.core.parameters import get_parameters
from smajax.model.rigs import arm
from studies.gains.record import HERE

ARM = arm()
RECORDED = [
    ("backstepping_one", "tuned_everywhere", presets.backstepping_one(presets.with_printed_law(ARM))),
    ("backstepping_two", "tuned_everywhere", presets.backstepping_two(presets.with_printed_law(ARM))),
    ("stress_sliding", "tuned_everywhere", presets.quick_stress_sliding(ARM)),
    ("temperature_vsc", "temperature_vsc", presets.temperature_vsc(ARM)),
    ("pid", "tuned_everywhere", presets.pid(ARM)),
    *(("pid", f"tuned_at_{degrees}_deg", presets.pid_tuned_at(ARM, degrees)) for degrees in presets.PID_TUNED_AT),
    ("vsc", "vsc2", presets.vsc2(ARM)),
    ("vsc", "vsc3", presets.vsc3(ARM)),
    ("vsc", "vsc3_of_section_4_6", presets.vsc3_of_section_4_6(ARM)),
]


@pytest.mark.parametrize(
    ("file", "search", "tuned"), RECORDED, ids=lambda value: value if isinstance(value, str) else ""
)
def test_presets_have_the_recorded_gains(file: str, search: str, tuned: Any) -> None:
    gains = json.loads((HERE / f"{file}.json").read_text(encoding="utf-8"))[search]["gains"]
    np.testing.assert_allclose(get_parameters(tuned, list(gains)), list(gains.values()), rtol=1e-12)
