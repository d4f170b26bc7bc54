"""In the reference: a field tells what its line tells, the unit, bounds and meaning of `parameter(...)` or its comment."""

from __future__ import annotations

from typing import Any

from griffe import Attribute, Docstring, ExprCall, Extension


class Parameters(Extension):
    """Gives a field without a docstring the one that stands beside it."""

    def on_attribute_instance(self, *, attr: Attribute, **kwargs: Any) -> None:
        """Called by griffe for every attribute."""
        if attr.docstring is not None or attr.parent is None or not attr.parent.is_class:
            return
        call = attr.value
        if isinstance(call, ExprCall) and str(call.function) == "parameter":
            unit, low, high, about, *_ = (str(argument).strip("\"'") for argument in call.arguments)
            attr.docstring = Docstring(f"{about}; {unit}, from {low} to {high}", parent=attr)
            return
        lines = attr.lines_collection[attr.filepath][(attr.lineno or 1) - 1 : attr.endlineno]
        commented = next((line for line in lines if "  # " in line), "")  # a long one stands in brackets, lines below
        _, mark, comment = commented.partition("  # ")
        if mark and not comment.startswith(("type:", "noqa")):
            attr.docstring = Docstring(comment.strip(), parent=attr)
