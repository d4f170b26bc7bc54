"""What is known of an effect before any run, in words: for the list of effects and for its page."""

from __future__ import annotations

import math

from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import PRIOR_ODDS, Width
from smajax.model.effects.prior_width import unit_of_width


def odds_in_words(effect: type[AbstractEffect]) -> str:
    """As "material, odds 0.1"."""
    return f"{effect.candidate.prior_class}, odds {PRIOR_ODDS[effect.candidate.prior_class]:g}"


def width_in_words(unit: str, width: Width) -> str:
    """As "0 ± 20000 J/kg", or "5 s, times or over 4.5" of a logarithmic one: base and standard deviation.

    `width`: with its base (`prior_width.stated_width`). `unit`: that of the coefficient.
    """
    own = "" if unit == "-" and not width.of else f" {unit_of_width(unit, width)}"
    if width.logarithmic:
        return f"{width.base:g}{own}, times or over {math.exp(width.sigma):.2g}"
    return f"{width.base:g} ± {width.sigma:g}{own}"
