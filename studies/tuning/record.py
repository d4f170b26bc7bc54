"""Where the study's numbers are stored: one JSON file, a part of it at a time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from smajax.core.files import json_text, replace

HERE = Path(__file__).parent


def kept(path: Path) -> dict[str, Any]:
    """What is there already."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def keep(path: Path, part: str, name: str, value: Any) -> dict[str, Any]:
    """The whole after `part`.`name` was put in and written."""
    whole = kept(path)
    whole.setdefault(part, {})[name] = value
    replace(path, json_text(whole))
    return whole
