"""Formulas of effects, which are plain text, with raised and lowered parts for a page."""

from __future__ import annotations

import html
import re

from markupsafe import Markup

GREEK = {
    "sigma": "σ",
    "mu": "µ",
    "delta": "δ",
    "xi": "ξ",
    "tau": "τ",
    "rho": "ρ",
    "eps": "ε",
    "epsilon": "ε",
    "theta": "θ",
    "alpha": "α",
    "inf": "∞",
    "pi": "π",
}
_PART = r"(?:\{([^}]*)\}|([A-Za-z0-9]+))"


def _greek(text: str) -> str:
    return GREEK.get(text, text)


def typeset(formula: str) -> Markup:
    """`h_c`, `I^2` and `T_inf` as set in print; everything else as it stands, escaped."""
    text = html.escape(formula)
    text = re.sub(rf"_{_PART}", lambda m: f"<sub>{_greek(m[1] or m[2])}</sub>", text)
    text = re.sub(rf"\^(?:{_PART}|\(([^)]*)\))", lambda m: f"<sup>{m[1] or m[2] or m[3]}</sup>", text)
    text = re.sub(
        r"(?<![A-Za-z&])(d?)(sigma|mu|delta|xi|tau|rho|eps|epsilon|theta|alpha)(?![A-Za-z])",
        lambda m: m[1] + _greek(m[2]),
        text,
    )
    return Markup(text)
