"""Machine code on disk, under a key of the program's own text, so that another process need not compile it again.

Where JAX caches its compiled programs (`jax_compilation_cache_dir`, which our commands set), and only there. The key is of
LLVM's text of the program, the versions of what wrote and compiles it, its options, and the processor: an edited comment compiles
nothing anew, and whatever changes a program changes its key. What is read is machine code and nothing else.
"""

from __future__ import annotations

import hashlib
import os
import platform
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path

import jax

from smajax.core.files import writing
from smajax.engine.kernel import options_of, processor

LARGEST = 2**30  # bytes in the folder: beyond, what was not used longest goes
HEAD = b"smajax program 3\n"
PACKAGES = ("smajax", "jax", "jaxlib", "llvmlite", "numpy")


@cache
def versions() -> str:
    """Of everything that writes or compiles a program."""

    def one(name: str) -> str:
        try:
            return f"{name} {version(name)}"
        except Exception:  # not there, or with metadata that cannot be read: a message must not fail for it
            return f"{name} (none)"

    return ", ".join([f"Python {platform.python_version()}", *map(one, PACKAGES)])


def folder() -> Path | None:
    """Where programs are cached; None where JAX caches none."""
    values = jax.config.values
    place = values["jax_compilation_cache_dir"]
    if not place or "://" in place or not values["jax_enable_compilation_cache"]:  # a bucket somewhere is JAX's alone
        return None
    return Path(place) / "native"


def key_of(text: str, quickly: bool = False) -> str:
    """Of a program by its text, and whether it is compiled quickly."""
    packages = versions().split(", ", 1)[1]  # the interpreter has no part in it
    options = ", ".join(f"{name} {value}" for name, value in sorted(options_of(quickly).items()))
    return hashlib.sha256("\n".join([packages, processor(), options, text]).encode()).hexdigest()


def load(key: str) -> bytes | None:
    """The machine code under a key; None where there is nothing whole."""
    place = folder()
    if place is None:
        return None
    with suppress(OSError):
        raw = (place / key).read_bytes()
        digest, code = raw[len(HEAD) : len(HEAD) + 32], raw[len(HEAD) + 32 :]
        if not raw.startswith(HEAD) or hashlib.sha256(key.encode() + code).digest() != digest:
            return None
        with suppress(OSError):  # a folder that others may read only
            os.utime(place / key)
        return code
    return None


def save(key: str, code: bytes) -> None:
    """Cache machine code; where that cannot be done, it is compiled again the next time."""
    place = folder()
    if place is None:
        return
    with suppress(OSError):
        place.mkdir(parents=True, exist_ok=True)
        with writing(place / key) as file:
            file.write(HEAD + hashlib.sha256(key.encode() + code).digest() + code)
        _make_room(place)


def _make_room(place: Path) -> None:
    known = sorted(((one.stat().st_mtime, one.stat().st_size, one) for one in place.iterdir()), reverse=True)
    total = 0
    for _, size, path in known:
        total += size
        if total > LARGEST:
            path.unlink(missing_ok=True)
