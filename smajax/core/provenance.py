"""Where a result comes from: versions, code state, every parameter of the model, and a digest that tells two apart."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import subprocess
import uuid
import warnings
from collections.abc import Sequence
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np

from smajax.core import plugins
from smajax.core.own_code import UnreadableCodeError, code_digest, own_parts
from smajax.core.parameters import parameter_values

PACKAGES = ("smajax", "jax", "jaxlib", "equinox", "numpy")
NOT_READ = "{} cannot be read ({}): work that was kept in a folder cannot be known to be of the same code, and is not used again."
FIT_PACKAGES = ("smajax", "jax", "equinox", "numpy", "optimistix", "scipy")


@lru_cache(maxsize=1)
def source_mark() -> str:
    """Hex digest over every module of the package."""
    digest = hashlib.sha256()
    for file in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def git_state() -> str:
    """Commit of the working folder, with `+changes` where files differ from it; empty outside a repository."""

    def asked(*words: str) -> str:
        try:
            # Without optional locks: a `status` that is killed while it refreshes the index would leave the repository locked.
            command = ["git", "--no-optional-locks", *words]
            return subprocess.run(command, capture_output=True, text=True, timeout=5, check=True).stdout.strip()
        except (OSError, subprocess.SubprocessError):
            return ""

    commit = asked("rev-parse", "HEAD")
    return commit + ("+changes" if commit and asked("status", "--porcelain", "-uno") else "")


@lru_cache(maxsize=8)
def _git_state_in(folder: str) -> str:
    """`git_state` of the working folder, asked once a process: git takes tens of milliseconds, more than many a batch."""
    return git_state() if folder else ""


def _working_folder() -> str:
    """Empty where it was removed."""
    try:
        return os.getcwd()
    except OSError:
        return ""


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    return {name: metadata.version(name) for name in PACKAGES} | {"python": platform.python_version()}


class UnreadableCodeWarning(UserWarning):
    """Code of a part that cannot be read: kept work is not used again."""


def code_mark(what: str, *things: Any) -> str:
    """Digest of the code and the values of parts that may be the user's (`own_code`).

    Of what cannot be read, which `what` names in a warning, it is another one at every call, so that no kept work is found by it.
    """
    try:
        return code_digest(*things)
    except UnreadableCodeError as error:
        warnings.warn(NOT_READ.format(what, error), UnreadableCodeWarning, stacklevel=3)
        return uuid.uuid4().hex


def digest(model: Any, more: Sequence[str | np.ndarray] = ()) -> str:
    """Hex digest of the code, also of classes and functions in `model` that are not of the package, of the structure and the numbers of `model`, and of `more`."""
    # An address is another one in every process; what is there, `own_parts` finds.
    structure = re.sub(r" at 0x[0-9a-f]+", "", str(jax.tree.structure(model)))
    mark = hashlib.sha256(f"{source_mark()} {plugins.versions() or ''} {structure}".encode())
    for part in own_parts(model):
        mark.update(code_mark(f"The code of {getattr(part, '__qualname__', part)}", part).encode())
    for leaf in (*jax.tree.leaves(model), *more):
        text = getattr(leaf, "__qualname__", "a function") if callable(leaf) else leaf
        mark.update(text.encode() if isinstance(text, str) else np.ascontiguousarray(text).tobytes())
    return mark.hexdigest()


def provenance(model: eqx.Module, **settings: object) -> dict[str, str]:
    """Attributes of a result: text only, so that every format can hold them; no `git` outside of a repository, else as it was at the process's first result."""
    rows = {f"version of {name}": version for name, version in versions().items()}
    rows |= {name: str(value) for name, value in settings.items()}
    commit = _git_state_in(_working_folder())
    rows |= {"git": commit} if commit else {}
    return rows | {"parameters (SI)": json.dumps(parameter_values(model))}


def made_with() -> dict[str, str]:
    """Versions, Python and the machine, in words."""
    return {
        **{f"version of {name}": metadata.version(name) for name in FIT_PACKAGES},
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {jax.default_backend()}",
    }
