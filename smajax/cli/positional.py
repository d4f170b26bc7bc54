"""What to say to `--load dead_weight` where the load is an argument without a name."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from itertools import takewhile
from typing import Any

from typer.core import TyperArgument, TyperCommand

from smajax.cli.log_lines import announce

ORDINALS = ("first", "second", "third")


def _argument(name: str, arguments: Sequence[TyperArgument], args: Sequence[str], command: str) -> str:
    """Where the argument stands, behind those typed or by default before it; "" where there is none of this name."""
    names = [str(one.name) for one in arguments]
    own = name.lstrip("-").replace("-", "_")
    if own not in names:
        return ""
    place = names.index(own)
    words = [word for word in args if word == name or word.startswith(f"{name}=")][:1]
    after = "".join(args[args.index(name) + 1 :][:1]) if name in args else "".join(words).partition("=")[2]
    value = shlex.quote(after) if after and not after.startswith("-") else own.upper()
    typed = list(takewhile(lambda word: not word.startswith("-"), args))[:place]
    before = [*typed, *(str(one.default or str(one.name).upper()) for one in arguments[len(typed) : place])]
    where = f"the {ORDINALS[place]} argument" if len(names) > 1 else "an argument"
    return f"`{own}` is {where}, without a name: {' '.join([command, *before, value])}"


class Command(TyperCommand):
    """A command that knows its arguments by their names too, to say where they stand, and that begins its log of progress."""

    def invoke(self, ctx: Any) -> Any:
        """As typer's. A command within a budget runs as a process of its own, which begins the log."""
        if "out" in ctx.params and ctx.params.get("budget") is None:
            announce(str(self.name))
        return super().invoke(ctx)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Raises what typer raises, with that added to "No such option"."""
        typed = list(args)
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            # Its class is click's or a copy of it, by the version of typer.
            wrong: Any = error
            if type(error).__name__ == "NoSuchOption":
                arguments = [one for one in self.params if isinstance(one, TyperArgument)]
                advice = _argument(wrong.option_name, arguments, typed, f"smajax {self.name}")
                if advice:
                    wrong.message, wrong.possibilities = f"No such option: {wrong.option_name}; {advice}", None
            raise
