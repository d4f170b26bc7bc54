"""What is exported: a block with parameters, inputs and outputs that starts and steps, whatever is in it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from smajax.model.types import Scalar

Values = Mapping[str, Scalar]


@dataclass(frozen=True)
class Quantity:
    """A parameter, an input or an output: SI, temperatures in degrees Celsius, angles in radians. start: its value before anybody sets it."""

    name: str
    unit: str
    about: str
    start: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    @property
    def c_name(self) -> str:
        """As a member of a C structure: `latent_heat_enthalpy`."""
        return identifier(self.name)


@dataclass(frozen=True)
class Block:
    """`start(parameters, inputs)` and `step(parameters, state, inputs, seconds)`, pure, each giving (state, outputs by name).

    The state is any pytree of numbers and small arrays, of the same shapes from both. period: of a sampled block, which steps by
    that alone (s); None: it steps by any time.
    """

    name: str
    title: str
    parameters: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    start: Callable[[Values, Values], tuple[Any, Values]]
    step: Callable[[Values, Any, Values, Scalar], tuple[Any, Values]]
    period: float | None = None


KEYWORDS = frozenset(
    [
        "auto",
        "bool",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "false",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "true",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
    ]
)


def identifier(text: str) -> str:
    """`text` as a name in C: letters, digits and `_`, the first no digit, and none of C's own words."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_") or "block"
    return f"x{name}" if name[0].isdigit() else f"{name}_" if name in KEYWORDS else name
