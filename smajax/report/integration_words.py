"""What an integration leaves in a result, in a sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from smajax.core.display_units import digits


def integration_sentence(error: Mapping[str, Any]) -> str:
    """Of an `IntegrationError.record`; empty where nothing is known."""
    if not error:
        return ""
    how = error["how"]
    if "largest_rms_over_noise" in error:
        return f"Integrated with {how}; the error (root mean square) is {digits(error['largest_rms_over_noise'], 2)} times the noise."
    share = error["largest_rms_over_stroke"]
    if share is None or not math.isfinite(share):
        return f"Integrated with {how}, as asked for; its error was not measured."
    against, aim = error.get("against"), error.get("aimed_for")
    what = f"the error, its difference from {against}," if against else "the error"
    beyond = f": more than the {digits(100.0 * aim, 3)} % that is aimed for" if aim is not None and share > aim else ""
    return f"Integrated with {how}; {what} is {digits(100.0 * share, 3 if beyond else 2)} % of a whole transformation (root mean square){beyond}."
