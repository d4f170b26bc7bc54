"""Machine code runs in pieces: Ctrl-C and a caller that gives up end it soon, and the pieces change no number."""

from __future__ import annotations

import subprocess
import sys
import threading
import time

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.engine import kernel, program
from smajax.engine.kernel import PIECE_SECONDS, Stopped, in_pieces
from tests.helpers.engine_results import summed


def _pieces(seconds_a_vector: float, last: int, group: int, monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """What machine code that takes `seconds_a_vector` is called for."""
    clock, called = [0.0], []
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])

    def call(first: int, end: int) -> None:
        called.append((first, end))
        clock[0] += seconds_a_vector * (end - first)

    in_pieces(call, 5, last, group, threading.Event())
    return called


@pytest.mark.parametrize("seconds_a_vector", [1e-7, 1e-3, 0.01, 10.0])
def test_pieces_are_whole_groups_one_after_another_of_some_tenths_of_a_second(
    seconds_a_vector: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    called = _pieces(seconds_a_vector, 5005, 6, monkeypatch)
    assert [called[0][0], *(end for _, end in called)] == [*(first for first, _ in called), 5005]
    sizes = [end - first for first, end in called]
    assert all(size % 6 == 0 for size in sizes[:-1])
    assert max(sizes) * seconds_a_vector <= max(PIECE_SECONDS, 6 * seconds_a_vector) * 1.0001
    assert len(sizes) <= 6 + 5000 * seconds_a_vector / PIECE_SECONDS * 1.3 or max(sizes) == 6


def test_a_stop_ends_it_before_the_next_piece() -> None:
    stop, called = threading.Event(), []

    def call(first: int, end: int) -> None:
        called.append((first, end))
        stop.set()

    with pytest.raises(Stopped):
        in_pieces(call, 0, 100, 6, stop)
    assert called == [(0, 6)]


@pytest.mark.parametrize("threads", [1, 2])
def test_results_are_the_same_in_pieces_of_one_group(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    made = program(summed, jnp.asarray(0.1), ("a",), engine="native")
    values = np.random.default_rng(0).normal(size=1001)
    whole = made(jnp.asarray(0.1), {"a": values}, threads)
    monkeypatch.setattr(kernel, "PIECE_SECONDS", 0.0)
    np.testing.assert_array_equal(made(jnp.asarray(0.1), {"a": values}, threads), whole)


def test_a_call_that_was_stopped_is_not_done_again_by_xla() -> None:
    made, stop = program(summed, jnp.asarray(0.1), ("a",)), threading.Event()
    stop.set()
    with pytest.raises(Stopped):
        made(jnp.asarray(0.1), {"a": np.arange(3.0)}, 1, stop)
    assert made.native is not None


BATCH = """
import os, signal, threading, time
signal.signal(signal.SIGINT, signal.default_int_handler)
import numpy as np
from smajax.core.runtime import prepare
prepare()
from smajax.engine import kernel
from smajax.model.rigs import arm
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.measures import Last

kernel.COMPILE_OPTIONS.update({"codegen_level": 0, "speed_level": 0})

def batch(count, seconds):
    axes = zipped({"voltage": np.linspace(5.0, 9.0, count)})
    run_batch(arm(), {}, axes, seconds=seconds, keep=(), measures=(Last("position"),), tolerance=None)

batch(64, 6.0)  # compiled
called = threading.Event()

def told(call, *rest, pieces=kernel.in_pieces):
    called.set()
    pieces(call, *rest)

kernel.in_pieces = told

def interrupt():
    called.wait()
    time.sleep(0.5)
    print(time.time(), flush=True)
    os.kill(os.getpid(), signal.SIGINT)

threading.Thread(target=interrupt, daemon=True).start()
try:
    batch(1_000_000, 6.0)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


def test_ctrl_c_in_a_large_batch_ends_the_process_within_seconds() -> None:
    """A million runs take minutes; a piece takes tenths of a second, more where cores are shared."""
    told = subprocess.run([sys.executable, "-c", BATCH], capture_output=True, text=True, check=False, timeout=120)
    ended = time.time()
    begun, word = told.stdout.split()
    assert (told.returncode, word) == (0, "interrupted"), told.stderr
    assert ended - float(begun) < 5.0
