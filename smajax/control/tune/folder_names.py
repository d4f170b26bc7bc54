"""The names of the files of a tuning, without anything that reads or writes them: `smajax app` lists them before JAX is loaded."""

from __future__ import annotations

# `asked.json` has this name since version 0.1: folders of before are resumed.
SETTINGS, STATE, FINISH, GAINS, RECORD = "asked.json", "state.npz", "finish.npz", "gains.json", "tune.json"
PAGES = ("tune.html", "loops.csv", "before_after.png", "descent.png")
RESULTS = frozenset({SETTINGS, GAINS, RECORD, *PAGES})  # of a finished tuning
FILES = RESULTS | {STATE, FINISH}
KEPT = (SETTINGS, STATE, FINISH)  # what the command keeps for itself, to resume from
