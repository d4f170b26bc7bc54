"""Commands and options that have a new name: the old one works for one minor version, with a message."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

# (command, old option) -> (new option, version without the old one); ("", old command) -> the same of a command.
RENAMED: Mapping[tuple[str, str], tuple[str, str]] = {
    ("sweep", "--gain-shares"): ("--gain-ratios", "0.3"),
}


def with_new_names(
    words: Sequence[str], renamed: Mapping[tuple[str, str], tuple[str, str]] = RENAMED
) -> tuple[list[str], list[str]]:
    """The words behind `smajax` with the new names, and a message for each old one."""
    result, messages, command = [], [], ""
    for place, word in enumerate(words):
        first = not command and not word.startswith("-")
        name, sign, value = word.partition("=") if word.startswith("--") else (word, "", "")
        # After `--` nothing is an option.
        entry = None if "--" in words[:place] else renamed.get(("" if first else command, name))
        if entry is None:
            result.append(word)
            command = command or (word if first else "")
            continue
        new, gone = entry
        messages.append(f"{name} is {new} now; the old name goes in version {gone}")
        result.append(f"{new}{sign}{value}")
        command = command or (new if first else "")
    return result, messages
