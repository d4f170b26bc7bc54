"""How a function of one run becomes a function of many: the one facade to compiled programs.

In: a pure function `function(model, own)` of one run, a model (a pytree) and the names of the numbers that each run has of its
own. Out: a `Program` for arrays of these numbers, by machine code or by XLA (`program`). Nothing here knows of wires, files of
measured data or reports.

A batched JAX program on a CPU runs one small loop over all runs after another, and every number between two of them
goes through the cache: a step of a wire is some hundred such loops. Here the same program, traced by JAX for *one* run,
becomes one loop over groups of runs, few enough that all they need stays in the nearest cache from the first step to the
last, in phases (`phases`) that keep their results in registers.

jaxpr (`translate`, `array_operations`, `jax_versions`) -> LLVM's language (`text`, `arithmetic`, `phases`) -> machine code, and threads that run it
(`kernel`), cached on disk (`cache`); or `xla`.
"""

from smajax.engine.facade import Engine as Engine
from smajax.engine.facade import EngineError as EngineError
from smajax.engine.facade import EngineWarning as EngineWarning
from smajax.engine.facade import Program as Program
from smajax.engine.facade import engine_of as engine_of
from smajax.engine.facade import program as program
from smajax.engine.text import Unsupported as Unsupported
