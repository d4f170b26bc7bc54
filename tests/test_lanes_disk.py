"""Machine code that is kept on disk: the same numbers in another process, and never that of something else."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import smajax.stage_equations
import smajax.stage_solver
import smajax.step
import smajax.system
import smajax.wire.shape
from smajax.compiled import simulate_compiled
from smajax.drive.voltage import Voltage
from smajax.effects.base import AbstractEffect
from smajax.extended import extended
from smajax.lanes import disk, evaluate
from smajax.presets import build
from smajax.system import System
from smajax.types import Trajectory

ARM = build("niti_table_3_1", "arm", "amplified_voltage")
OTHER = build("niti_table_3_1", "dead_weight", "voltage")
HEATED = {"voltage": jnp.full(120, 7.0)}


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
    remembered = dict(evaluate._kept)
    evaluate._kept.clear()
    with _programs_in(str(tmp_path)):
        yield tmp_path / "lanes"
    evaluate._kept.clear()
    evaluate._kept.update(remembered)


def _run(system: System = ARM) -> Trajectory:
    return simulate_compiled(system, HEATED, 0.01)


def _same(one: Trajectory, other: Trajectory) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True))


def test_what_is_kept_is_read_and_is_the_same_to_the_bit(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = _run()
    assert len(list(programs.iterdir())) == 1
    evaluate._kept.clear()

    def never(*_: object) -> None:
        raise AssertionError("traced although it was kept")

    monkeypatch.setattr(jax, "make_jaxpr", never)
    read = _run()
    assert isinstance(read, Trajectory)
    assert _same(made, read)


def test_another_process_reads_it_too(programs: Path) -> None:
    code = (
        "import numpy as np, jax.numpy as jnp\nfrom smajax.runtime import prepare\nprepare()\n"
        "from smajax.compiled import simulate_compiled\nfrom smajax.lanes import evaluate\nfrom smajax.presets import build\n"
        "run = simulate_compiled(build('niti_table_3_1', 'arm', 'amplified_voltage'), {'voltage': jnp.full(120, 7.0)}, 0.01)\n"
        "print(run.position[-1].hex())"
    )
    env = {**os.environ, "JAX_COMPILATION_CACHE_DIR": str(programs.parent)}
    first, second = (
        subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert first == second == f"{float(_run().position[-1]).hex()}\n"
    assert len(list(programs.iterdir())) == 1


@pytest.mark.parametrize("spoilt", ["cut", "changed", "empty", "of a later version"])
def test_a_damaged_program_is_made_anew(programs: Path, spoilt: str) -> None:
    made = _run()
    (path,) = programs.iterdir()
    raw = path.read_bytes()
    path.write_bytes(
        {
            "cut": raw[:-7],
            "changed": raw[:-100] + b"!" + raw[-99:],
            "empty": b"",
            "of a later version": raw.replace(b"program 1", b"program 2", 1),
        }[spoilt]
    )
    evaluate._kept.clear()
    assert _same(_run(), made)
    assert path.read_bytes() == raw


class Windy(AbstractEffect):
    """An effect of a notebook, which may be another one tomorrow."""

    effect_name = "windy"

    @classmethod
    def base(cls) -> Windy:
        return cls()


def test_what_is_not_ours_alone_is_not_kept(programs: Path) -> None:
    model = (ARM, HEATED)

    def local(_: object, __: object) -> None: ...

    assert disk.key_of(build, model, ()) is not None
    assert disk.key_of(local, model, ()) is None
    assert disk.key_of(build, (Windy(), HEATED), ()) is None
    assert disk.key_of(build, (ARM, object()), ()) is None


def test_a_key_is_of_kinds_and_settings_and_not_of_values(monkeypatch: pytest.MonkeyPatch) -> None:
    key = disk.key_of(build, ARM, ("a",))
    warmer = eqx.tree_at(lambda one: one.wire.heat.ambient_temperature, ARM, ARM.wire.heat.ambient_temperature + 11.0)
    assert disk.key_of(build, warmer, ("a",)) == key
    others = [
        disk.key_of(build, ARM, ("b",)),
        disk.key_of(build, ARM, ("a",), alone=True),
        disk.key_of(extended, ARM, ("a",)),
        disk.key_of(build, extended(ARM, ("latent_heat",)), ("a",)),
        disk.key_of(build, OTHER, ("a",)),
        disk.key_of(build, (ARM, jnp.zeros(3)), ("a",)),
        disk.key_of(build, (ARM, jnp.zeros(4)), ("a",)),
        disk.key_of(build, (ARM, 1), ("a",)),
        disk.key_of(build, (ARM, True), ("a",)),
    ]
    assert len({key, *others}) == len(others) + 1
    # What a user puts in the place of a constant that the program was traced with makes another program.
    traced = disk.key_of(simulate_compiled, ARM, ("a",))
    monkeypatch.setattr(smajax.stage_solver, "CLOSE", 3e-6)
    assert disk.key_of(simulate_compiled, ARM, ("a",)) != traced


def test_what_somebody_put_in_our_place_is_not_kept_under_our_name(monkeypatch: pytest.MonkeyPatch) -> None:
    key = disk.key_of(simulate_compiled, ARM, ())
    assert key is not None
    power, equation = Voltage.power, smajax.system.heating_power

    def doubled(*given: object) -> object:
        return 2.0 * equation(*given)  # type: ignore[arg-type]

    for place, name, other in (
        (Voltage, "power", lambda *given: 2.0 * power(*given)),
        (smajax.stage_equations, "heating_power", doubled),
        (smajax.stage_equations, "heating_power", smajax.system.ambient_temperature),
        (smajax.stage_solver, "INNER", (1, 1)),
        (smajax.stage_solver, "DRIVING", (lambda *_: 5.0, smajax.stage_solver.DRIVING[1])),
        (smajax.wire.shape, "quarter_cosine", jax.custom_jvp(lambda share: 1.0 - share**2)),
        (smajax.wire.shape, "quarter_cosine", functools.partial(lambda power, share: 1.0 - share**power, 2)),
        (smajax.step, "_solved", eqx.filter_custom_jvp(lambda given: given)),
        (smajax.step, "_solved", object()),
    ):
        with monkeypatch.context() as patched:
            patched.setattr(place, name, other)
            assert disk.key_of(simulate_compiled, ARM, ()) != key, name
        assert disk.key_of(simulate_compiled, ARM, ()) == key
    # Edited, or upgraded, after it was imported: what runs is not what lies there.
    monkeypatch.setattr(disk, "CHANGED", disk.CHANGED - 1.0)
    assert disk.key_of(simulate_compiled, ARM, ()) is None


@pytest.mark.parametrize("place", [None, "gs://bucket/programs"])
def test_nothing_is_kept_without_a_folder_of_this_machine(place: str | None) -> None:
    with _programs_in(place):
        assert disk.folder() is None


def test_the_oldest_programs_make_room(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _run()
    (first,) = programs.iterdir()
    os.utime(first, (1.0, 1.0))
    monkeypatch.setattr(disk, "MOST", first.stat().st_size + 100)
    _run(OTHER)
    (left,) = programs.iterdir()
    assert left != first
