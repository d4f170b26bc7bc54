"""A jitted function compiled and timed; imports jax when it is asked, for interpreters that have little else."""

from __future__ import annotations

import time
from typing import Any, NamedTuple


class Timed(NamedTuple):
    """The best of some repeats, the compilation, and what the program needs beside what it is given."""

    seconds: float
    compile_s: float
    memory_MB: float

    def named(self, name: str) -> dict[str, float]:
        """As the parts of the benchmark keep it."""
        return {
            f"{name}_s": self.seconds,
            f"{name}_compile_s": self.compile_s,
            f"{name}_memory_MB": self.memory_MB,
        }


def timed(jitted: Any, repeats: int, *given: Any) -> Timed:
    """Seconds of wall clock of `jitted(*given)`."""
    import jax

    begin = time.perf_counter()
    made = jitted.lower(*given).compile()
    compiled = time.perf_counter() - begin
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        jax.block_until_ready(made(*given))
        times.append(time.perf_counter() - begin)
    room = made.memory_analysis()
    return Timed(min(times), compiled, room.temp_size_in_bytes / 1e6 if room else float("nan"))
