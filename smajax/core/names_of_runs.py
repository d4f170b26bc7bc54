"""Names of values that each run has of its own: `austenite_start[first]` is the parameter `austenite_start` in the run `first`."""

from __future__ import annotations


def of_run(parameter: str, run: str) -> str:
    """The name of a parameter's value in one run."""
    return f"{parameter}[{run}]"


def is_of_run(name: str) -> bool:
    """Whether a name is that of a value in one run."""
    return "[" in name


def parameter_of(name: str) -> str:
    """The parameter that a value belongs to, in one run or in all."""
    return name.split("[", 1)[0]
