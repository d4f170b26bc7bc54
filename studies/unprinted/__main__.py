"""`python -m studies.unprinted [dead_weight sliding surface layer backstepping pid]`: find the values, and write the record."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import jax

from . import backstepping, dead_weight, pid, sliding, switches

RECORD = Path(__file__).parent / "values.json"
SEARCHES = {
    "dead_weight": dead_weight.found,
    "sliding": sliding.found,
    "surface": switches.surface,
    "layer": switches.layer,
    "backstepping": backstepping.found,
    "pid": pid.found,
}


def main(names: list[str]) -> None:
    """The searches named, or all; a record that is not searched anew stays."""
    record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    for name in names or list(SEARCHES):
        record[name] = SEARCHES[name]()
        text = json.dumps({one: record[one] for one in SEARCHES if one in record}, indent=2)
        text = re.sub(r"\[[^\[\]{}]*\]", lambda result: f"[{' '.join(result[0][1:-1].split())}]", text)
        RECORD.write_text(text + "\n", encoding="utf-8")
        print(name, json.dumps(record[name]["values"]))


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    main(sys.argv[1:])
