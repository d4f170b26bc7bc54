"""Every input channel has a unit."""

from __future__ import annotations


def test_every_input_of_every_load_and_drive_has_a_unit() -> None:
    from smajax.core.units import convert
    from smajax.model.channels import INPUT_UNITS
    from smajax.model.presets import DRIVES, LOADS

    for made in (*LOADS.values(), *DRIVES.values()):
        own = made()
        for name in own.inputs_required | own.inputs_optional:
            assert convert(1.0, INPUT_UNITS[name], INPUT_UNITS[name]) == 1.0, name
