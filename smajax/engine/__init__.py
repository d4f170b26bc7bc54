"""How a function of one run becomes a function of many: the one facade to compiled programs.

In: a pure function `function(model, own)` of one run, a model (a pytree) and the names of the numbers that each run has of its
own. Out: a `Program` for arrays of these numbers, by machine code or by XLA (`program`). Nothing here knows of wires, files of
measured data or reports.

A batched JAX program on a CPU runs one small loop over all runs after another, and every number between two of them
goes through the cache: a step of a wire is some hundred such loops. Here the same program, traced by JAX for *one* run,
becomes one loop over groups of runs, few enough that all they need stays in the nearest cache from the first step to the
last, in phases (`phases`) that keep their results in registers.

Also public, for who divides runs into chunks: the sizes of blocks that XLA runs (`block_size`, `rounded`, `ON_CARD`, `on_card`), and what keys
and bounds a cache of traced functions (`key_of`, `cached`).

jaxpr (`translate`, `translation`, `directions`, `array_operations`, `jax_versions`) -> LLVM's language (`text`, `arithmetic`, `parts`, `phases`, `phase_functions`) ->
machine code, and threads that run it (`kernel`), cached on disk (`cache`); or `xla`.
"""

from smajax.engine.arguments import Along as Along
from smajax.engine.arguments import key_of as key_of
from smajax.engine.facade import Coming as Coming
from smajax.engine.facade import Engine as Engine
from smajax.engine.facade import EngineError as EngineError
from smajax.engine.facade import EngineWarning as EngineWarning
from smajax.engine.facade import Program as Program
from smajax.engine.facade import Wanted as Wanted
from smajax.engine.facade import begin_programs as begin_programs
from smajax.engine.facade import by_machine_code as by_machine_code
from smajax.engine.facade import cached as cached
from smajax.engine.facade import engine_of as engine_of
from smajax.engine.facade import program as program
from smajax.engine.facade import programs as programs
from smajax.engine.text import Unsupported as Unsupported
from smajax.engine.xla import ON_CARD as ON_CARD
from smajax.engine.xla import block_size as block_size
from smajax.engine.xla import on_card as on_card
from smajax.engine.xla import rounded as rounded
