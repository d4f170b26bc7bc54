"""Machine code that is kept on disk: under the program's own text, the same numbers in another process, and never another program's."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.engine import cache, facade, kernel, native
from smajax.model.presets import build
from smajax.model.system import System
from smajax.model.types import Trajectory
from smajax.model.wire.laws import under_law
from smajax.simulation.compiled import simulate_compiled

COUPON = build("flexinol_table_3_2", "coupon", "none")
OTHER = dataclasses.replace(COUPON, wire=under_law(COUPON.wire, "liang"))
HEATED = {"temperature": jnp.linspace(20.0, 110.0, 120), "stress": jnp.full(120, 1e8)}


@contextmanager
def _programs_in(place: str | None) -> Iterator[None]:
    before = jax.config.values["jax_compilation_cache_dir"]
    jax.config.update("jax_compilation_cache_dir", place)
    try:
        yield
    finally:
        jax.config.update("jax_compilation_cache_dir", before)


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Path]:
    """An empty folder for programs, and nothing remembered of them in this process."""
    remembered = dict(facade._programs)
    facade._programs.clear()
    with _programs_in(str(tmp_path)):
        yield tmp_path / "native"
    facade._programs.clear()
    facade._programs.update(remembered)


def _run(system: System = COUPON) -> Trajectory:
    return simulate_compiled(system, HEATED, 0.01)


def _same(one: Trajectory, other: Trajectory) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True))


def test_a_cached_program_is_read_and_gives_the_same_bits(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = _run()
    assert len(list(programs.iterdir())) == 1
    facade._programs.clear()

    def never(*_: object) -> None:
        raise AssertionError("compiled although it was kept")

    monkeypatch.setattr(native, "compiled", never)
    read = _run()
    assert isinstance(read, Trajectory)
    assert _same(made, read)


def test_another_process_reads_the_cached_program(programs: Path) -> None:
    code = (
        "import numpy as np, jax.numpy as jnp\nfrom smajax.core.runtime import prepare\nprepare()\n"
        "from smajax.simulation.compiled import simulate_compiled\nfrom smajax.model.presets import build\n"
        "inputs = {'temperature': jnp.linspace(20.0, 110.0, 120), 'stress': jnp.full(120, 1e8)}\n"
        "run = simulate_compiled(build('flexinol_table_3_2', 'coupon', 'none'), inputs, 0.01)\n"
        "print(run.strain[-1].hex())"
    )
    env = {**os.environ, "JAX_COMPILATION_CACHE_DIR": str(programs.parent)}
    own = float(_run().strain[-1]).hex()
    (path,) = programs.iterdir()
    written = path.stat().st_ino  # a file that is written anew is another one
    told = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    assert told.stdout == f"{own}\n"
    assert list(programs.iterdir()) == [path]
    assert path.stat().st_ino == written


@pytest.mark.parametrize("spoilt", ["cut", "changed", "empty", "of a later version"])
def test_a_damaged_cached_program_is_compiled_again(programs: Path, spoilt: str) -> None:
    made = _run()
    (path,) = programs.iterdir()
    raw = path.read_bytes()
    path.write_bytes(
        {
            "cut": raw[:-7],
            "changed": raw[:-100] + b"!" + raw[-99:],
            "empty": b"",
            "of a later version": raw.replace(cache.HEAD, b"smajax program 99\n", 1),
        }[spoilt]
    )
    facade._programs.clear()
    assert _same(_run(), made)
    assert path.read_bytes() == raw


def test_the_cached_file_of_another_program_is_not_used(programs: Path) -> None:
    _run(OTHER)
    (other,) = programs.iterdir()
    kept = other.read_bytes()
    made = _run()
    (path,) = set(programs.iterdir()) - {other}
    path.write_bytes(kept)
    facade._programs.clear()
    assert _same(_run(), made)


def test_a_comment_changes_no_key_and_an_equation_does(programs: Path) -> None:
    def plain(model: Any, own: dict[str, Any]) -> Any:
        return model * own["a"] + 1.0

    def explained(model: Any, own: dict[str, Any]) -> Any:
        """The same, and what it means."""
        return model * own["a"] + 1.0  # one more

    def other(model: Any, own: dict[str, Any]) -> Any:
        return model * own["a"] + 1.0 + 1e-16

    def kept(function: Any, model: Any) -> int:
        run = facade.program(function, model, ("a",), engine="native")
        np.testing.assert_allclose(run(model, {"a": np.arange(3.0)}, 1), np.asarray(model) * np.arange(3.0) + 1.0)
        return len(list(programs.iterdir()))

    assert kept(plain, jnp.asarray(2.0)) == 1
    assert kept(explained, jnp.asarray(5.0)) == 1  # nor do a model's numbers
    assert kept(other, jnp.asarray(2.0)) == 2
    assert kept(plain, 2.0) == 3  # a number that is no array is part of the program


def test_a_program_of_other_versions_is_not_used(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _run()
    (first,) = programs.iterdir()
    facade._programs.clear()
    monkeypatch.setattr(cache, "versions", lambda: "Python 3.99, smajax 0.0.9")
    _run()
    assert len(list(programs.iterdir())) == 2
    assert cache.key_of("text") != first.name


def test_a_program_of_other_compile_options_is_not_used(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _run()
    facade._programs.clear()
    monkeypatch.setitem(kernel.COMPILE_OPTIONS, "speed_level", 2)
    _run()
    assert len(list(programs.iterdir())) == 2


def test_a_program_that_is_compiled_quickly_has_a_key_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    keys = [cache.key_of("text", quickly) for quickly in (False, True)]
    monkeypatch.setitem(kernel.COMPILE_OPTIONS, "speed_level", 2)
    keys += [cache.key_of("text", quickly) for quickly in (False, True)]
    assert len(set(keys)) == 4


def test_a_program_of_another_processor_is_not_used(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder that machines share: what one runs may be an illegal instruction to another."""
    _run()
    facade._programs.clear()
    monkeypatch.setattr(cache, "processor", lambda: "another")
    _run()
    assert len(list(programs.iterdir())) == 2


@pytest.mark.parametrize("place", [None, "gs://bucket/programs"])
def test_nothing_is_cached_without_a_cache_folder(place: str | None) -> None:
    with _programs_in(place):
        assert cache.folder() is None


def test_the_oldest_cached_programs_are_removed_first(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _run()
    (first,) = programs.iterdir()
    os.utime(first, (1.0, 1.0))
    monkeypatch.setattr(cache, "LARGEST", first.stat().st_size + 100)
    _run(OTHER)
    (left,) = programs.iterdir()
    assert left != first
