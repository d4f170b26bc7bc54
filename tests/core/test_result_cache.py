"""Finished work of an earlier run is taken from the folder and counted; that of this run is not counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from smajax.core.result_cache import ResultCache


def test_what_this_run_saved_is_not_of_an_earlier_one(tmp_path: Path) -> None:
    first = ResultCache(tmp_path)
    key = first.key(np.arange(3.0), "a fit")
    assert first.load(key) is None
    first.save(key, {"values": np.arange(3.0)})
    assert first.load(key) is not None
    assert first.reused == 0
    later = ResultCache(tmp_path)
    found = later.load(key)
    assert found is not None
    np.testing.assert_array_equal(found["values"], np.arange(3.0))
    assert later.reused == 1
    assert first.time_taken(12.4) == {"seconds": "12"}
    assert later.time_taken(12.4) == {
        "seconds": "12",
        "seconds are counted": "since the resume: the time of the earlier run is not in them",
    }
