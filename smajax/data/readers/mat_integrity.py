"""Whether the elements of a MATLAB 5 file fit into each other: a compiled reader that believes a damaged one ends the program.

Layout: "MAT-File Format", MathWorks, level 5. A file is a heading of 128 bytes and elements, each a tag (type, bytes) and its
content; an array is an element that holds its flags, dimensions and name, and then elements again.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator

HEADING = 128
DEEPEST = 100  # arrays within arrays
BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}  # of a number, by its type
TEXT = {**BYTES, 16: 1, 17: 2, 18: 4}
NAME, LENGTH = (1, 2, 16), (5, 6)
ARRAY, COMPRESSED = 14, 15
CELL, STRUCTURE, OBJECT, CHARACTERS, SPARSE = 1, 2, 3, 4, 5
NUMBERS = range(6, 16)
OPAQUE = (16, 17)  # functions, and objects of MATLAB's own making, such as strings, tables and time series
IMAGINARY = 0x800
Element = tuple[int, memoryview]  # its type and its content


class Damaged(ValueError):
    """What does not fit."""


class Opaque(ValueError):
    """An array holds what only MATLAB knows how it lies."""


def _elements(content: memoryview, order: str) -> Iterator[Element]:
    at = 0
    while at < len(content):
        if len(content) - at < 8:
            raise Damaged(f"{len(content) - at} bytes are left where an element should begin")
        kind, size = struct.unpack_from(f"{order}II", content, at)
        short = kind >> 16
        start, size, kind = (at + 4, short, kind & 0xFFFF) if short else (at + 8, size, kind)
        if size > (4 if short else len(content) - start):
            raise Damaged(f"an element says that it has {size} bytes, and {len(content) - start} are left")
        yield kind, content[start : start + size]
        # The next one begins at a multiple of eight; what is compressed is packed without a gap.
        at = at + 8 if short else start + size + (0 if kind == COMPRESSED else -size % 8)


def _next(parts: Iterator[Element], *kinds: int) -> memoryview:
    kind, content = next(parts, (0, memoryview(b"")))
    if kind not in kinds:
        raise Damaged(f"an element of type {kind} stands where {' or '.join(map(str, kinds))} should")
    return content


def _numbers(parts: Iterator[Element], count: int) -> None:
    kind, content = next(parts, (0, memoryview(b"")))
    if kind not in BYTES or len(content) != count * BYTES[kind]:
        raise Damaged(f"{count} numbers are announced, and {len(content)} bytes of type {kind} follow")


def _arrays(parts: Iterator[Element], order: str, count: int, depth: int) -> None:
    for _ in range(count):
        _array(_next(parts, ARRAY), order, depth + 1)


def _array(content: memoryview, order: str, depth: int = 0) -> None:
    if depth > DEEPEST:
        raise Damaged(f"arrays lie in each other more than {DEEPEST} deep")
    if not len(content):
        return  # an empty place of a cell or a field
    parts = _elements(content, order)
    flags = _next(parts, 6)
    if len(flags) != 8:
        raise Damaged(f"the flags of an array have {len(flags)} bytes, not 8")
    word, _ = struct.unpack_from(f"{order}II", flags)
    kind, imaginary = word & 0xFF, bool(word & IMAGINARY)
    if kind in OPAQUE:
        raise Opaque
    sizes = _next(parts, *LENGTH)
    if len(sizes) < 4 or len(sizes) % 4:
        raise Damaged(f"the dimensions of an array have {len(sizes)} bytes")
    dimensions = struct.unpack(f"{order}{len(sizes) // 4}i", sizes)
    if min(dimensions) < 0 or len(dimensions) > 32:
        raise Damaged(f"an array has the dimensions {dimensions[:4]}")
    count = math.prod(dimensions)
    _next(parts, *NAME)  # its name
    if kind == CELL:
        _arrays(parts, order, count, depth)
    elif kind in (STRUCTURE, OBJECT):
        if kind == OBJECT:
            _next(parts, *NAME)
        long = _next(parts, *LENGTH)
        names = _next(parts, *NAME)
        length = struct.unpack_from(f"{order}i", long)[0] if len(long) == 4 else 0
        if length < 1 or len(names) % length or count > len(content):
            raise Damaged(f"{len(names)} bytes of names of fields, {length} each, of {count} structs")
        _arrays(parts, order, count * (len(names) // length), depth)
    elif kind == CHARACTERS:
        if count > max(len(text := _next(parts, *TEXT)), 1):
            raise Damaged(f"{count} characters are announced, and {len(text)} bytes of them follow")
    elif kind == SPARSE:
        for _ in range(3 + imaginary):
            _next(parts, *BYTES)
    elif kind in NUMBERS:
        for _ in range(1 + imaginary):
            _numbers(parts, count)
    else:
        raise Damaged(f"an array is of class {kind}, which there is not")


def _name(content: memoryview, order: str) -> str:
    """That of an array of a file: the first text in it."""
    for kind, held in _elements(content, order):
        if kind in NAME:
            return bytes(held).decode("latin-1")
    return ""


def _whole(kind: int, element: memoryview, order: str) -> memoryview:
    """An array of a file, unpacked."""
    if kind == COMPRESSED:
        try:
            inside = _elements(memoryview(zlib.decompressobj().decompress(element)), order)
        except zlib.error as error:
            raise Damaged(f"what is compressed cannot be read ({error})") from None
        kind, element = next(inside, (0, memoryview(b"")))
    if kind != ARRAY:
        raise Damaged(f"an element of type {kind} stands where an array should")
    return element


def sound_arrays(content: bytes) -> dict[str, bool]:
    """The arrays of a MATLAB 5 file by their names, and whether a reader may go through each: not where one is opaque.

    Raises Damaged where an element is larger than what holds it, or is not what is announced.
    """
    if len(content) < HEADING or content[126:128] not in (b"IM", b"MI"):
        raise Damaged(f"a heading of {HEADING} bytes that ends in IM or MI should begin it")
    order = "<" if content[126:128] == b"IM" else ">"
    result: dict[str, bool] = {}
    for kind, packed in _elements(memoryview(content)[HEADING:], order):
        element = _whole(kind, packed, order)
        name = _name(element, order)
        try:
            _array(element, order)
            result[name] = result.get(name, True)
        except Opaque:
            result[name] = False
    return result
