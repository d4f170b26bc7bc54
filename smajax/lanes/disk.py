"""Machine code on disk, under a key of everything that it was made from, so that a process need not make it again.

Where JAX keeps its compiled programs (`jax_compilation_cache_dir`, which our commands set), and only there: without such
a folder nothing is kept. Only programs made of this package's own parts are, as they lie in its files: what another package
or a notebook defines, or has put in the place of something here, may be another thing tomorrow under the same name. Nothing
is kept by a process whose package was edited or upgraded under it. Nothing is unpickled.
"""

from __future__ import annotations

import dataclasses
import hashlib
import inspect
import json
import os
import platform
import re
import sys
import sysconfig
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache, partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from types import BuiltinFunctionType, FunctionType, ModuleType
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.lanes.kernel import processor
from smajax.lanes.text import Array
from smajax.report.files import writing

PACKAGE = "smajax"
ROOT = Path(__file__).parents[1]
# What classes here inherit from.
BELOW = tuple(Path(package.__file__).parent for package in (jax, eqx) if package.__file__)
MOST = 2**30  # bytes in the folder: beyond, what was not used longest goes
HEAD = b"smajax program 1\n"
# What a process remembers of its own work: no program depends on it.
REMEMBERED = ("smajax.lanes.evaluate._kept", "smajax.batch.engine._shapes")


class Untold(Exception):
    """Something that no key can stand for."""


class Stored(NamedTuple):
    """A compiled program and what is needed to call it."""

    code: bytes
    lanes: int
    results: tuple[Array, ...]
    scratch: int
    shared: tuple[str, ...]  # kinds of the arrays that all members share
    tree: Any  # a `jax.tree_util.PyTreeDef`


def folder() -> Path | None:
    """Where programs are kept; None where JAX keeps none."""
    values = jax.config.values
    place = values["jax_compilation_cache_dir"]
    if not place or "://" in place or not values["jax_enable_compilation_cache"]:  # a bucket somewhere is JAX's alone
        return None
    return Path(place) / "lanes"


def key_of(function: Callable[..., Any], model: Any, names: tuple[str, ...], alone: bool = False) -> str | None:
    """Of a program and of all that it is made from; None where it is not ours alone."""
    modules: set[str] = set()
    try:
        said = [_said(function, modules), _said(model, modules), list(names), alone, str(jnp.zeros(()).dtype)]
        said += [_constants(modules), _surroundings()]
    except (Untold, TypeError, OSError):  # a source that is gone
        return None
    return hashlib.sha256(json.dumps(said).encode()).hexdigest()


def load(key: str) -> Stored | None:
    """What was kept under a key; None where there is nothing whole."""
    place = folder()
    if place is None:
        return None
    path = place / key
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError, ImportError):
        raw = path.read_bytes()
        digest, rest = raw[len(HEAD) : len(HEAD) + 32], raw[len(HEAD) + 32 :]
        if not raw.startswith(HEAD) or hashlib.sha256(rest).digest() != digest:
            return None
        told, _, code = rest.partition(b"\n")
        record = json.loads(told)
        results = tuple(Array(tuple(shape), kind) for shape, kind in record["results"])
        leaves, tree = jax.tree.flatten(_made(record["tree"]))
        if leaves != list(range(len(results))):
            return None
        with suppress(OSError):  # a folder that others may read only
            os.utime(path)
        return Stored(code, record["lanes"], results, record["scratch"], tuple(record["shared"]), tree)
    return None


def save(key: str, program: Stored) -> None:
    """Keep a program; where that cannot be done, it is made anew the next time."""
    place = folder()
    if place is None:
        return
    with suppress(OSError, Untold):
        record = {
            "lanes": program.lanes,
            "results": [[one.shape, one.dtype] for one in program.results],
            "scratch": program.scratch,
            "shared": program.shared,
            "tree": _shape(jax.tree.unflatten(program.tree, range(len(program.results)))),
        }
        rest = json.dumps(record).encode() + b"\n" + program.code
        place.mkdir(parents=True, exist_ok=True)
        with writing(place / key) as file:
            file.write(HEAD + hashlib.sha256(rest).digest() + rest)
        _make_room(place)


def _make_room(place: Path) -> None:
    known = sorted(((one.stat().st_mtime, one.stat().st_size, one) for one in place.iterdir()), reverse=True)
    total = 0
    for _, size, path in known:
        total += size
        if total > MOST:
            path.unlink(missing_ok=True)


def _own(value: type | FunctionType) -> str:
    """`module:name` of a class or function of this package, where that is where it is found."""
    module, name = value.__module__, value.__qualname__
    if module.partition(".")[0] != PACKAGE or _found(module, name) is not value:
        raise Untold(f"{module}.{name}")
    return f"{module}:{name}"


def _found(module: str, name: str) -> Any:
    found: Any = sys.modules.get(module) or import_module(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return found


def _said(value: Any, modules: set[str]) -> Any:
    """A value as JSON: arrays by their kind, all else by what it is; `modules` gets those of its classes. Untold: not ours."""

    def named(own: type | FunctionType) -> str:
        told = _own(own)
        modules.add(own.__module__)
        return told

    def said(one: Any) -> Any:
        return _said(one, modules)

    if isinstance(value, jax.Array | np.ndarray):
        return ["array", list(value.shape), str(value.dtype), bool(getattr(value, "weak_type", False))]
    if value is None or isinstance(value, bool | int | float | complex | str):
        return [type(value).__name__, repr(value)]
    if isinstance(value, type | FunctionType):
        return ["named", named(value)]
    if isinstance(value, dict):
        return ["dict", [[said(name), said(one)] for name, one in sorted(value.items())]]
    if isinstance(value, frozenset):
        return ["set", sorted(json.dumps(said(one)) for one in value)]
    if isinstance(value, eqx.Module):
        fields = [field.name for field in dataclasses.fields(value)]
        return ["module", named(type(value)), [[name, said(getattr(value, name))] for name in fields]]
    if isinstance(value, tuple | list):
        kind = type(value).__name__ if type(value) in (tuple, list) else named(type(value))
        return [kind, [said(one) for one in value]]
    raise Untold(repr(type(value)))


def _shape(value: Any) -> Any:
    """A tree whose leaves are their numbers as JSON, from which `_made` makes it again."""
    if value is None or type(value) is int:
        return value
    if type(value) is tuple or type(value) is list:
        return [type(value).__name__, [_shape(one) for one in value]]
    if type(value) is dict and all(isinstance(name, str) for name in value):
        return ["dict", {name: _shape(one) for name, one in value.items()}]
    if isinstance(value, tuple):
        return ["named", _own(type(value)), [_shape(one) for one in value]]
    if isinstance(value, eqx.Module):
        fields = dataclasses.fields(value)
        if any(field.metadata.get("static", False) for field in fields):
            raise Untold(repr(type(value)))
        return ["module", _own(type(value)), {field.name: _shape(getattr(value, field.name)) for field in fields}]
    raise Untold(repr(type(value)))


def _made(told: Any) -> Any:
    if told is None or isinstance(told, int):
        return told
    kind, *rest = told
    if kind in ("tuple", "list"):
        return {"tuple": tuple, "list": list}[kind]([_made(one) for one in rest[0]])
    if kind == "dict":
        return {name: _made(one) for name, one in rest[0].items()}
    module, _, name = rest[0].partition(":")
    if module.partition(".")[0] != PACKAGE:
        raise ValueError(module)
    made = _found(module, name)
    if kind == "named":
        return made(*(_made(one) for one in rest[1]))
    found = object.__new__(made)
    for field, one in rest[1].items():
        object.__setattr__(found, field, _made(one))
    return found


def _code() -> tuple[str, float]:
    """(digest of our own code as it lies on the disk, when it was last changed, s)."""
    code, latest = hashlib.sha256(), 0.0
    for path in SOURCES:
        code.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
        latest = max(latest, path.stat().st_ctime)  # which nobody can set back
    return code.hexdigest(), latest


SOURCES = sorted(ROOT.rglob("*.py"))
# Of the code that this process runs: read when the first of it that can trace anything is imported.
CODE, CHANGED = _code()


@cache
def _others() -> str:
    packages = ("jax", "jaxlib", "equinox", "numpy", "llvmlite")
    return " ".join([platform.python_version(), *(f"{name} {version(name)}" for name in packages), processor()])


def _surroundings() -> str:
    """Our own code, that of those that trace and compile it, and the processor. Untold where our code is changing."""
    if max(path.stat().st_ctime for path in SOURCES) != CHANGED:
        raise Untold("the package was edited or upgraded after it was imported")
    return f"{CODE} {_others()}"


def _constants(roots: set[str]) -> str:
    """Values, functions and classes of the modules behind a program, as they are now. Untold where one is not ours."""
    told = hashlib.sha256()
    waiting, seen = sorted(roots), set(roots)
    while waiting:
        name = waiting.pop(0)
        for own, value in sorted(vars(sys.modules[name]).items()):
            if own.startswith("__") or f"{name}.{own}" in REMEMBERED:
                continue
            behind: set[str] = set()
            told.update(f"{name}.{own}={_entry(value, name, behind)};".encode())
            for module in sorted(behind):
                if module.partition(".")[0] == PACKAGE and module not in seen and module in sys.modules:
                    seen.add(module)
                    waiting.append(module)
    return told.hexdigest()


def _entry(value: Any, name: str, behind: set[str], within: tuple[FunctionType, ...] = ()) -> str:
    """What stands under a name of the module `name`, as text; `behind` gets the modules that it is from. Untold: not ours."""

    def entry(one: Any) -> str:
        return _entry(one, name, behind, within)

    if _plain(value) or isinstance(value, bytes | Path | re.Pattern):
        return repr(_ordered(value))
    if isinstance(value, np.ndarray | jax.Array):
        return f"{value.dtype}{np.asarray(value).tolist()}"
    if isinstance(value, ModuleType):
        behind.add(value.__name__)
        return value.__name__
    if isinstance(value, type):
        behind.add(value.__module__)
        told = f"{value.__module__}.{value.__qualname__}"
        if not _lies_here(value.__module__):
            raise Untold(told)
        return f"{told}:{_body(value)}" if value.__module__ == name else told
    if isinstance(value, FunctionType):
        behind.add(value.__module__)
        code = inspect.unwrap(value).__code__
        installed = _installed(code.co_filename) and not _known(code.co_filename)
        told = f"{value.__module__}.{value.__qualname__}" if installed else _function(value)
        if value in within:
            return told
        held = [cell.cell_contents for cell in value.__closure__ or ()]
        return f"{told}({','.join(_entry(one, name, behind, (*within, value)) for one in held)})"
    if isinstance(value, Mapping):
        return "".join(sorted(f"{entry(key)}:{entry(one)}," for key, one in value.items()))
    if isinstance(value, tuple | list | set | frozenset):
        several = [entry(one) for one in value]
        return f"({','.join(several if isinstance(value, tuple | list) else sorted(several))})"
    if isinstance(value, partial):
        return f"partial {entry(value.func)} {entry(value.args)} {entry(value.keywords)}"
    if type(value).__module__ in ("typing", "types", "collections.abc", "__future__", "jaxtyping"):
        return repr(value)
    if isinstance(value, BuiltinFunctionType) or type(value).__name__ == "cython_function_or_method":
        return f"{value.__module__}.{value.__qualname__}"
    if layers := _layers(value):
        # What wraps a function: a form of it that is compiled, or has a derivative of its own.
        return f"{type(value).__module__}.{type(value).__qualname__}({','.join(map(entry, layers))})"
    if dataclasses.is_dataclass(value):
        return f"{_own(type(value))}({', '.join(entry(getattr(value, one.name)) for one in dataclasses.fields(value))})"
    raise Untold(f"{name}: {type(value)}")


def _lies_here(module: str) -> bool:
    """Whether a module is ours or that of a package that is installed, and not what a program or a notebook defines."""
    if module.partition(".")[0] == PACKAGE or module in sys.builtin_module_names:
        return True
    file = getattr(sys.modules.get(module), "__file__", None)
    return module != "__main__" and file is not None and (_installed(file) or _known(file))


def _body(value: type) -> str:
    """What the methods of a class consist of. Untold where they do not come from this package's files."""
    told = []
    for own, entry in sorted(vars(value).items()):
        found = _behind(entry)
        generated = own.startswith("__") and found is not None and found.__code__.co_filename == "<string>"
        if found is not None and not generated:  # what a data class is given follows from its fields
            told.append(f"{own}:{_function(found)}")
        elif _plain(entry):
            told.append(f"{own}={_ordered(entry)!r}")
    return ";".join(told)


def _layers(value: Any) -> list[FunctionType]:
    """The function that something wraps, and the rules for its derivative on the way there; none where it wraps none."""
    found: list[FunctionType] = []
    for _ in range(5):
        if isinstance(value, FunctionType):
            return [*found, value]
        rules = (getattr(value, way, None) for way in ("jvp", "fwd", "bwd"))
        found += [one for one in rules if isinstance(one, FunctionType)]
        inner = (getattr(value, name, None) for name in ("__wrapped__", "__func__", "fget", "method", "fun", "fn"))
        value = next((one for one in inner if one is not None), None)
    return []


def _behind(entry: Any) -> FunctionType | None:
    """The function of a method, property or what wraps it."""
    layers = _layers(entry)
    return inspect.unwrap(layers[-1]) if layers else None


def _function(value: FunctionType) -> str:
    code = inspect.unwrap(value).__code__
    if not _known(code.co_filename):
        raise Untold(f"{value.__module__}.{value.__qualname__}, of {code.co_filename}")
    return f"{value.__module__}.{value.__qualname__}:{code.co_filename}:{code.co_firstlineno}"


def _installed(file: str) -> bool:
    return "site-packages" in Path(file).parts


@cache
def _known(file: str) -> bool:
    """Whether a file is this package's, or of what stands in the key by its version."""
    path = Path(file)
    if path.is_relative_to(ROOT) or any(path.is_relative_to(one) for one in BELOW):
        return True
    return path.is_relative_to(sysconfig.get_path("stdlib")) and not _installed(file)


def _plain(value: Any) -> bool:
    if isinstance(value, tuple | list | frozenset | set):
        return all(map(_plain, value))
    if isinstance(value, dict):
        return all(_plain(name) and _plain(one) for name, one in value.items())
    return value is None or isinstance(value, bool | int | float | str)


def _ordered(value: Any) -> Any:
    """The same with sets as sorted lists: their own order is another one in every process."""
    if isinstance(value, set | frozenset):
        return sorted(map(repr, value))
    if isinstance(value, tuple | list):
        return [_ordered(one) for one in value]
    if isinstance(value, dict):
        return [(name, _ordered(one)) for name, one in value.items()]
    return value
