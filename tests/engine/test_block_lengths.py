"""XLA compiles a program for few block lengths: one that is there is used until another would have paid for itself."""

from __future__ import annotations

from smajax.engine.xla import ENOUGH_TO_COMPILE, BlockLengths


def test_a_program_compiled_for_few_runs_serves_for_more() -> None:
    blocks = BlockLengths()
    assert [blocks.of(count) for count in (7, 1, 94, 94)] == [8, 8, 8, 8]


def test_a_program_compiled_for_many_runs_serves_for_one() -> None:
    blocks = BlockLengths()
    assert [blocks.of(count) for count in (110, 1, 55)] == [64, 64, 64]


def test_a_block_length_that_is_used_often_is_compiled() -> None:
    blocks = BlockLengths()
    blocks.of(1)
    lengths = [blocks.of(512) for _ in range(1000)]
    assert lengths[0] == 8
    assert lengths[-1] == 64
    # 64 blocks of 8 runs take the time of some 27 of such blocks more than 8 of 64 do.
    assert 5 < lengths.index(64) < ENOUGH_TO_COMPILE
    assert blocks.of(1) == 8


def test_few_block_lengths_serve_any_number_of_runs() -> None:
    blocks = BlockLengths()
    found = {blocks.of(count) for _ in range(50) for count in (1, 3, 60, 200, 512, 513, 5000)}
    assert found <= {8, 64, 512}
