"""Commands and options that were called otherwise: the old name goes on working for a minor version, and says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

# (command, old option) -> (the new one, the version that will not have the old one); ("", old command) for a command.
RENAMED: Mapping[tuple[str, str], tuple[str, str]] = {}


def as_now(
    typed: Sequence[str], renamed: Mapping[tuple[str, str], tuple[str, str]] = RENAMED
) -> tuple[list[str], list[str]]:
    """What was typed after `smajax` by the names of today, and a sentence for each old one."""
    found, told, command = [], [], ""
    for place, word in enumerate(typed):
        first = not command and not word.startswith("-")
        name, sign, value = word.partition("=") if word.startswith("--") else (word, "", "")
        # After `--` nothing is an option.
        old = None if "--" in typed[:place] else renamed.get(("" if first else command, name))
        if old is None:
            found.append(word)
            command = command or (word if first else "")
            continue
        now, gone = old
        told.append(f"{name} is {now} now; the old name goes in version {gone}")
        found.append(f"{now}{sign}{value}")
        command = command or (now if first else "")
    return found, told
