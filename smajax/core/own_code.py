"""What parts do that are not of the package (a controller, a load, an effect, a law, an estimator of the user), as a digest of their code.

Kept work is found again by a digest of the package and of the model's numbers, which does not know a class that a script or a notebook
defines. Here such a class or function is read as it is loaded, not as its file is now: bytecode, constants, default values, closures, and what
it reads of its module, one after the other. Code of the package is named alone, since the digest of the package knows it
(`provenance.source_mark`); of installed packages the version and the file count.
"""

from __future__ import annotations

import dataclasses
import dis
import functools
import hashlib
import os
import platform
import sys
import sysconfig
import types
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

PACKAGE = __name__.partition(".")[0]
PLAIN = (type(None), bool, int, float, complex, str, bytes, type(Ellipsis), type(NotImplemented), np.generic, np.dtype)
COMPILED = (types.BuiltinFunctionType, types.MethodDescriptorType, types.WrapperDescriptorType, np.ufunc)
NAMED = (types.FunctionType, type, *COMPILED)
# Of a class what says nothing of what it does, or is read in another place.
PASSED_OVER = {"__module__", "__doc__", "__dict__", "__weakref__", "__annotations__", "__annotate__", "__abstractmethods__", "_abc_impl"}  # fmt: skip
PASSED_OVER |= {"__dataclass_params__", "__firstlineno__", "__static_attributes__", "__wrapped__", "__slots__"}


class UnreadableCodeError(ValueError):
    """Code or a value of a part that cannot be read, so that it cannot be told from another."""


def is_own(thing: Any) -> bool:
    """Whether a class or function is neither of the package nor of Python nor of an installed package."""
    return not _installed(getattr(thing, "__module__", None) or "")


def own_parts(model: Any) -> Iterator[type | Callable[..., Any]]:
    """The classes and functions of a model that are not of the package, each once, in the order of its fields."""
    seen: set[int] = set()

    def walk(node: Any) -> Iterator[type | Callable[..., Any]]:
        if isinstance(node, (*PLAIN, np.ndarray, jax.Array)) or id(node) in seen:
            return
        seen.add(id(node))
        if isinstance(node, NAMED):
            if is_own(node):
                yield node
            return
        if type(node) not in (tuple, list, dict):
            yield from walk(type(node))
        if isinstance(node, types.MethodType | functools.partial):
            yield from walk(node.__func__ if isinstance(node, types.MethodType) else node.func)
        for child in _children(node):
            yield from walk(child)

    return walk(model)


def _children(node: Any) -> Iterator[Any]:
    if isinstance(node, Mapping):
        yield from node.values()
    elif isinstance(node, tuple | list):
        yield from node
    elif dataclasses.is_dataclass(node):
        yield from (getattr(node, one.name, None) for one in dataclasses.fields(node))


def code_digest(*things: Any) -> str:
    """Hex digest of code and values of classes, functions, and objects that hold them. Raises UnreadableCodeError."""
    reader = _Reader()
    for one in things:
        reader.read(one)
    return reader.hash.hexdigest()


class _Reader:
    """One after the other what things consist of, into a digest; what was read before is named by its number."""

    def __init__(self) -> None:
        self.hash = hashlib.sha256(f"python {platform.python_version()}".encode())
        self.seen: dict[int, tuple[int, Any]] = {}  # with the object itself, so that no other one gets its address
        self.read_of_modules: set[tuple[str, str]] = set()

    def word(self, *parts: object) -> None:
        for one in parts:
            self.hash.update(f"{one}\0".encode(errors="backslashreplace"))

    def read(self, thing: Any, names: tuple[str, ...] = ()) -> None:
        """names: of a module, what is read of it."""
        if isinstance(thing, PLAIN):
            self.word(type(thing).__name__, repr(thing))
            return
        if isinstance(thing, types.ModuleType):
            self._module(thing, names)
            return
        if id(thing) in self.seen:
            self.word("seen", self.seen[id(thing)][0])
            return
        self.seen[id(thing)] = len(self.seen), thing
        if isinstance(thing, np.ndarray | jax.Array):
            self._array(thing)
        elif isinstance(thing, NAMED) and not is_own(thing):
            self._named(thing)
        elif isinstance(thing, types.FunctionType):
            self._function(thing)
        elif isinstance(thing, type):
            self._class(thing)
        elif isinstance(thing, types.CodeType):
            self._code(thing)
        else:
            self._value(thing)

    def _all(self, things: Any, *head: object) -> None:
        several = list(things)
        self.word(*head, len(several))
        for one in several:
            self.read(one)

    def _module(self, module: types.ModuleType, names: tuple[str, ...]) -> None:
        self.word("module", module.__name__, mark := _installed(module.__name__))
        for name in () if mark else names:
            # Two modules may read of each other.
            if name in vars(module) and (module.__name__, name) not in self.read_of_modules:
                self.read_of_modules.add((module.__name__, name))
                self.word(name)
                self.read(vars(module)[name], names)

    def _array(self, array: Any) -> None:
        if isinstance(array, jax.core.Tracer):
            raise UnreadableCodeError("an array that JAX traces")
        if isinstance(array, jax.Array) and jnp.issubdtype(array.dtype, jax.dtypes.prng_key):
            array = jax.random.key_data(array)
        values = np.asarray(array)
        if values.dtype.hasobject:
            self._all(values.ravel().tolist(), "array", values.shape)
            return
        self.word("array", values.dtype, values.shape)
        self.hash.update(np.ascontiguousarray(values).tobytes())

    def _named(self, thing: Any) -> None:
        module = thing.__module__ or ""
        self.word("named", module, getattr(thing, "__qualname__", getattr(thing, "__name__", "")), _installed(module))
        if (
            isinstance(thing, types.FunctionType) and "<locals>" in thing.__qualname__
        ):  # made by a call, whose values it holds
            self._cells(thing)

    def _function(self, function: types.FunctionType) -> None:
        self.word("function")
        self._code(function.__code__)
        self.read(function.__defaults__)
        self.read(function.__kwdefaults__)
        self._cells(function)
        if function.__dict__:
            self.read({name: one for name, one in function.__dict__.items() if name != "__wrapped__"})
            self.read(getattr(function, "__wrapped__", None))
        attributes = _names_of(function.__code__)
        for name in _globals_of(function.__code__):
            if name in function.__globals__:
                self.word("global", name)
                self.read(function.__globals__[name], attributes)
        for name in _imports_of(function.__code__):
            self.word("import", name)
            self.read(sys.modules.get(name), attributes)

    def _cells(self, function: types.FunctionType) -> None:
        for cell in function.__closure__ or ():
            try:
                self.read(cell.cell_contents)
            except ValueError as error:  # a cell that is still empty
                if isinstance(error, UnreadableCodeError):
                    raise
                self.word("empty")

    def _code(self, code: types.CodeType) -> None:
        self.word("code", code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
        self.hash.update(code.co_code)
        self.word(code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
        self.hash.update(getattr(code, "co_exceptiontable", b""))
        self._all(code.co_consts)

    def _class(self, cls: type) -> None:
        self.word("class", cls.__qualname__, type(cls).__qualname__)
        for one in cls.__mro__[1:]:
            self.read(one)
        for name, value in vars(cls).items():
            generated = getattr(getattr(value, "__code__", None), "co_filename", "") == "<string>"
            if name in PASSED_OVER or (generated and name.startswith("__")):
                continue
            self.word(name)
            if name == "__dataclass_fields__":
                self._all((one.name, one.default, one.default_factory, dict(one.metadata)) for one in value.values())
            else:
                self.read(value)

    def _value(self, thing: Any) -> None:
        """An object: its class and what it holds."""
        match thing:
            case tuple() | list():
                self.read(type(thing))
                self._all(thing)
            case set() | frozenset():
                self.read(type(thing))
                self._all(sorted(thing, key=repr), "set")
            case dict() | types.MappingProxyType():
                self.read(type(thing))
                self.read(getattr(thing, "default_factory", None))
                self._all((part for pair in thing.items() for part in pair), "table")
            case property():
                self._all((thing.fget, thing.fset, thing.fdel), "property")
            case staticmethod() | classmethod():
                self._all((thing.__func__,), type(thing).__name__)
            case types.MethodType():
                self._all((thing.__self__, thing.__func__), "method")
            case functools.partial():
                self._all((thing.func, thing.args, thing.keywords), "partial")
            case functools.cached_property():
                self._all((thing.func,), "property")
            case types.MemberDescriptorType() | types.GetSetDescriptorType():
                self.word("slot", thing.__name__)
            case _ if isinstance(thing, COMPILED):  # of a library of the user: its file stands for it
                of = getattr(thing, "__objclass__", None) or getattr(thing, "__self__", None)
                self.word("compiled", _file_mark(getattr(thing, "__module__", None) or ""), thing.__name__)
                self.read(None if isinstance(of, types.ModuleType) else of)
            case eqx.Module() if not hasattr(thing, "__wrapped__"):
                self._all((getattr(thing, one.name, None) for one in dataclasses.fields(thing)), "module of Equinox")
                self.read(type(thing))
            case _:
                self._other(thing)

    def _other(self, thing: Any) -> None:
        """What `functools.wraps` made of a function, or what can be copied."""
        wrapped = getattr(thing, "__wrapped__", None)
        if wrapped is not None:
            # What begins with an underscore in a library's is a cache, or where in its file the function is: no part of what it does.
            every = {name: one for name, one in getattr(thing, "__dict__", {}).items() if not name.startswith("__")}
            held = {name: one for name, one in every.items() if is_own(type(thing)) or not name.startswith("_")}
            self._all((type(thing), wrapped, held), "wrapped")
            return
        try:
            parts = thing.__reduce_ex__(4)
        except Exception as error:
            raise UnreadableCodeError(f"{type(thing).__qualname__}: {error}") from None
        if isinstance(parts, str):
            self.word("named", getattr(thing, "__module__", ""), parts)
            return
        self._all((list(one) if isinstance(one, Iterator) else one for one in parts), "object")


def _nested(code: types.CodeType) -> Iterator[types.CodeType]:
    yield code
    for one in code.co_consts:
        if isinstance(one, types.CodeType):
            yield from _nested(one)


def _globals_of(code: types.CodeType) -> list[str]:
    """What a function and those within it read of their module."""
    return sorted(
        {
            str(step.argval)
            for part in _nested(code)
            for step in dis.get_instructions(part)
            if step.opname in ("LOAD_GLOBAL", "LOAD_NAME")
        }
    )


def _imports_of(code: types.CodeType) -> list[str]:
    """Modules that a function and those within it import when they run; those that are loaded by then."""
    steps = (step for part in _nested(code) for step in dis.get_instructions(part))
    return sorted({str(step.argval) for step in steps if step.opname == "IMPORT_NAME"} & sys.modules.keys())


def _names_of(code: types.CodeType) -> tuple[str, ...]:
    return tuple(sorted({name for part in _nested(code) for name in part.co_names}))


@functools.lru_cache(maxsize=1)
def _folders() -> tuple[Path, tuple[Path, ...]]:
    """Of Python's own modules, and of installed packages."""
    paths = sysconfig.get_paths()
    return Path(paths["stdlib"]).resolve(), tuple(Path(paths[one]).resolve() for one in ("purelib", "platlib"))


@functools.cache
def _file_mark(module: str) -> str:
    """Digest of a module's file; "" without one."""
    file = getattr(sys.modules.get(module), "__file__", None)
    try:
        return hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16] if file else ""
    except OSError:
        return ""


def _installed(module: str) -> str:
    """What tells this module of the package, of Python or of an installed package from another; "" for one of the user."""
    top = module.partition(".")[0]
    return PACKAGE if top == PACKAGE else "" if module in ("", "__main__") else _mark_of(module, top)


@functools.cache
def _mark_of(module: str, top: str) -> str:
    file = getattr(sys.modules.get(module), "__file__", None) or getattr(sys.modules.get(top), "__file__", None)
    if file is None:
        return "python" if top in sys.stdlib_module_names else ""
    python, packages = _folders()
    path = Path(os.path.realpath(file))
    if any(path.is_relative_to(one) for one in packages):
        return f"{getattr(sys.modules.get(top), '__version__', '')} {_file_mark(module)}".strip() or "installed"
    return "python" if path.is_relative_to(python) and "site-packages" not in path.parts else ""
