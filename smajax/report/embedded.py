"""Pictures that lie within a page as text."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup
from PIL import Image, ImageSequence

from smajax.core.worker_process import in_two_processes

COLOURS = 64  # of a picture within a page: drawings have few, and take a third of the bytes
COMPRESSION = 8  # of zlib: 9 saves two bytes in a hundred more and takes more than twice the time


class Small(bytes):
    """A PNG as a page holds it."""


def small(png: bytes) -> Small:
    """The same picture with few colours; as it was where that is smaller."""
    if isinstance(png, Small):
        return png
    with Image.open(io.BytesIO(png)) as image:
        full = image.convert("RGB")
    few = full.quantize(COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    # The ground stays as white as the page.
    palette, ground = few.getpalette() or [], int(np.asarray(few)[0, 0])
    palette[3 * ground : 3 * ground + 3] = np.asarray(full)[0, 0].tolist()
    few.putpalette(palette)
    stream = io.BytesIO()
    few.save(stream, format="png", compress_level=COMPRESSION)
    return Small(min(stream.getvalue(), png, key=len))


def drawn_pictures(drawings: Sequence[tuple[Callable[..., bytes | None], tuple[Any, ...]]]) -> list[Small | None]:
    """What functions of modules draw of their arguments, PNG each, None where they draw nothing; every second one by a second process, where there is one."""
    return in_two_processes(_drawn, drawings)


def _drawn(function: Callable[..., bytes | None], arguments: tuple[Any, ...]) -> Small | None:
    png = function(*arguments)
    return None if png is None else small(png)


def small_film(gif: bytes) -> bytes:
    """The same film as a WebP without loss, which takes two thirds of the bytes."""
    with Image.open(io.BytesIO(gif)) as film:
        images = [one.convert("RGB") for one in ImageSequence.Iterator(film)]
        each = film.info.get("duration", 100)
    stream = io.BytesIO()
    how: dict[str, Any] = {"lossless": True, "method": 2, "minimize_size": True}
    images[0].save(stream, "webp", save_all=True, append_images=images[1:], duration=each, loop=0, **how)
    return stream.getvalue()


def _data(image: bytes) -> str:
    """An image, PNG or GIF, as an address that holds its bytes."""
    form, held = ("webp", small_film(image)) if image.startswith(b"GIF8") else ("png", small(image))
    return f"data:image/{form};base64,{base64.b64encode(held).decode('ascii')}"


def picture(image: bytes | None, alt: str, kind: str = "wide", upright: bytes | None = None) -> Markup:
    """An image, PNG or GIF, that carries its own bytes; nothing for a picture that there is none of.

    kind: `narrow` or `wide`, or `panels` for what is too wide for a telephone and moves sideways there; `upright` is shown
    there instead, the same panels one below the other.
    """
    if image is None:
        return Markup("")
    element = Markup('<img class="{}" src="{}" alt="{}">').format(kind, _data(image), alt)
    if upright is not None:
        other = Markup('<source media="(max-width: 720px)" srcset="{}">').format(_data(upright))
        element = Markup("<picture>{}{}</picture>").format(other, element)
    return Markup('<div class="scroll">{}</div>').format(element)
