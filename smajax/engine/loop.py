"""A loop that carries lanes: cells, each read at the top of a round and written at its end."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

from smajax.engine.text import Text
from smajax.engine.values import Held, held


class Loop:
    """Begun at `start`; `sure`: it runs once at least."""

    def __init__(self, text: Text, start: Sequence[Held], stem: str, sure: bool = True) -> None:
        self.text, self.before = text, text.block
        first = [one for array in start for one in array.ravel()]
        self.shapes = [array.shape for array in start]
        self.cells = [text.cell(one.dtype) for one in first]
        text.write(self.cells, first)
        self.top = text.new_label(stem)
        self.count = text.open(self.top, sure)
        self.carry = self.carried()

    def carried(self) -> list[Held]:
        """What it carries, here and now: within a round that of its beginning, after the loop what is left."""
        lanes = iter([self.text.present(cell) for cell in self.cells])
        return [held([next(lanes) for _ in range(prod(shape))], shape) for shape in self.shapes]

    def again(self, end: Sequence[Held]) -> None:
        """Back to the top with `end` as the carry."""
        self._left(end)
        self.text.jump(self.top)
        self.text.close(self.count, self._following(), self.before)

    def end_after(self, rounds: int, end: Sequence[Held] = ()) -> None:
        """The end of a loop of so many rounds, `end` the carry of the next."""
        text = self.text
        self._left(end)
        following, done = self._following(), text.new_label("done")
        text.branch(text.assign(f"icmp slt i64 {following}, {rounds}"), self.top, done)
        text.close(self.count, following, self.before)
        text.label(done)

    def _left(self, end: Sequence[Held]) -> None:
        self.text.write(self.cells, [one for array in end for one in array.ravel()])

    def _following(self) -> str:
        return self.text.assign(f"add i64 {self.count}, 1")
