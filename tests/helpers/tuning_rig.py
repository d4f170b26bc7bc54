"""The tuning of a sliding controller on few short loops."""

from __future__ import annotations

from smajax.control.tune.settings import TuneSettings

SECONDS, ROWS = 3.0, 10  # as the sweep of test_sweep.py: programs are compiled once
SETTINGS = TuneSettings(
    "vsc3",
    (0.0, 30.0),
    {"damping": 0.2},
    limits={"overshoot": 0.1},
    tried=4,
    starts=2,
    rounds=4,
    finish=3,
    seconds=SECONDS,
    unseen=2,
)
