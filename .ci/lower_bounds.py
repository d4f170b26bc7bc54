"""The lower bound of each dependency in a pyproject.toml, as constraints for pip."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

declared = tomllib.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["project"]["dependencies"]
for requirement in declared:
    found = re.match(r"([A-Za-z0-9_.-]+)(?:\[[^]]*\])?\s*>=\s*([0-9][0-9a-z.]*)", requirement)
    if found is None:
        sys.exit(f"{requirement!r} has no lower bound; write NAME>=VERSION")
    print(f"{found[1]}=={found[2]}")
