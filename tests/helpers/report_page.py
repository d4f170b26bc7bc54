"""A page as text, pictures and the numbers that its cells carry; an unknown term of a record."""

from __future__ import annotations

import base64
import io
from html.parser import HTMLParser

import numpy as np
from PIL import Image

from smajax.attribution.findings import Formula, UnknownTerm


class Page(HTMLParser):
    """What a browser would fetch, the text, the pictures and the numbers that cells carry."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.source = text
        self.addresses: list[str] = []
        self.tags: list[str] = []
        self.text: list[str] = []
        self.numbers: list[tuple[float, str]] = []  # (of the record, as shown)
        self.cell: float | None = None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        values = dict(attributes)
        self.addresses += [value for name in ("src", "href", "srcset", "action", "data") if (value := values.get(name))]
        self.cell = float(values["data-v"]) if tag == "td" and "data-v" in values else None

    def handle_data(self, data):
        self.text.append(data)
        if self.cell is not None:
            self.numbers.append((self.cell, data))
            self.cell = None

    def images(self) -> list[np.ndarray]:
        prefix = "data:image/png;base64,"
        coded = [address.removeprefix(prefix) for address in self.addresses if address.startswith(prefix)]
        return [np.asarray(Image.open(io.BytesIO(base64.b64decode(text))).convert("L")) for text in coded]


def made_unknown_term(name: str, named: bool, alike: tuple[str, ...] = ()) -> UnknownTerm:
    at = np.linspace(-1.0, 90.0, 61)
    values = 1.2 / (1.0 + np.exp(-(at - 52.0) / 4.0))
    return UnknownTerm(
        name=name,
        title="a heat loss depending on the <temperature>",
        equation="heat",
        symbol="T - T_inf",
        state="temperature over ambient",
        state_unit="K",
        unit="W/m",
        named=named,
        indistinguishable=alike,
        log_odds=31.4,
        score_gain=0.85,
        left_out_before=1.8e-3,
        left_out_after=2.0e-4,
        held_out_before=2.1e-3 if named else None,
        held_out_after=2.5e-4 if named else None,
        at=at,
        values=values,
        error=0.2 + 0.0 * at,
        error_held=0.05 + 0.0 * at,
        cells=np.linspace(-1.0, 90.0, 21),
        samples=np.arange(20),
        formulas=(Formula("1.27 (1 + tanh((T - T_inf - 52.4)/4.51))/2", 3.1, 2, 12.0, values[::2]),),
    )
