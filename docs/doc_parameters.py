"""In the reference: a field made by `parameter(...)` tells its unit, its bounds and its meaning."""

from __future__ import annotations

from typing import Any

from griffe import Attribute, Docstring, ExprCall, Extension


class Parameters(Extension):
    """Gives each such field the docstring that its call already holds."""

    def on_attribute_instance(self, *, attr: Attribute, **kwargs: Any) -> None:
        """Called by griffe for every attribute."""
        call = attr.value
        if not isinstance(call, ExprCall) or str(call.function) != "parameter" or attr.docstring is not None:
            return
        unit, low, high, about, *_ = (str(argument).strip("\"'") for argument in call.arguments)
        attr.docstring = Docstring(f"{about}; {unit}, from {low} to {high}", parent=attr)
