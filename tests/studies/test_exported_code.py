"""What the package chooses a precision by is what the study measured."""

import json
from typing import Any

from smajax.export.single_precision import RECORD
from studies.exported_code.run import RESULTS, record


def rows() -> list[dict[str, Any]]:
    return json.loads(RESULTS.read_text("utf-8"))["closed_loops"]


def test_the_packages_record_is_that_of_the_study():
    assert json.loads(RECORD.read_text("utf-8")) == record(rows())


def test_commands_are_the_packages_in_all_measured_loops():
    assert len(rows()) == 26
    for row in rows():
        assert row["loops"] == 10_000
        assert row["double"]["largest"] < 1e-9, row["controller"]
        assert row["single_interface"]["largest"] < 1e-7, row["controller"]
