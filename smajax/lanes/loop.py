"""A loop whose carry are lanes."""

from __future__ import annotations

from collections.abc import Sequence

from smajax.lanes.text import Lane, Text
from smajax.lanes.values import Held, held


class Loop:
    """Its first lines wait for what the last ones bring."""

    def __init__(self, text: Text, start: Sequence[Held], stem: str) -> None:
        self.text, self.start, self.before = text, start, text.block
        self.top = text.new_label(stem)
        text.jump(self.top)
        text.label(self.top)
        self.count, self.next = text.fresh("i"), text.fresh("i")
        self.carry = [held([Lane(text.fresh("c"), one.dtype) for one in array.ravel()], array.shape) for array in start]
        self.at = len(text.lines)
        text.lines += [""] * (1 + sum(array.size for array in start))

    def again(self, end: Sequence[Held]) -> None:
        """Back to the top with `end` as the carry."""
        text = self.text
        text.put(f"{self.next} = add i64 {self.count}, 1")
        lines = [f"  {self.count} = phi i64 [ 0, %{self.before} ], [ {self.next}, %{text.block} ]"]
        for start, here, new in zip(self.start, self.carry, end, strict=True):
            for one, name, other in zip(start.ravel(), here.ravel(), new.ravel(), strict=True):
                kind = text.vector(name.dtype)
                lines.append(
                    f"  {name.name} = phi {kind} [ {one.name}, %{self.before} ], [ {other.name}, %{text.block} ]"
                )
        text.lines[self.at : self.at + len(lines)] = lines
        text.jump(self.top)

    def end_after(self, rounds: int, end: Sequence[Held] = ()) -> None:
        """The end of a loop of so many rounds, `end` the carry of the next."""
        text = self.text
        more, done = text.new_label("more"), text.new_label("done")
        following = text.assign(f"add i64 {self.count}, 1")
        text.branch(text.assign(f"icmp slt i64 {following}, {rounds}"), more, done)
        text.label(more)
        self.again(end)
        text.label(done)
