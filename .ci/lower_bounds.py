"""The lower bound of each dependency in a pyproject.toml, those of the extras included, as constraints for pip."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

OF_WORK = ("cuda12", "dev", "docs")  # a card, and what work on the project itself needs: not what a command imports

project = tomllib.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["project"]
extras = [lines for extra, lines in project["optional-dependencies"].items() if extra not in OF_WORK]
for requirement in [*project["dependencies"], *(line for lines in extras for line in lines)]:
    if requirement.startswith(f"{project['name']}["):
        continue  # extras by the name of another one
    bound = re.match(r"([A-Za-z0-9_.-]+)(?:\[[^]]*\])?\s*>=\s*([0-9][0-9a-z.]*)", requirement)
    if bound is None:
        sys.exit(f"{requirement!r} has no lower bound; write NAME>=VERSION")
    print(f"{bound[1]}=={bound[2]}")
