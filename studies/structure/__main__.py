"""`python -m studies.structure [TREE]`: the counts of the package in a checkout (this one), as JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from studies.structure.counts import counted

if __name__ == "__main__":
    tree = Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parents[2]
    print(json.dumps(counted(tree), indent=2))
