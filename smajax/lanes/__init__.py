"""Batches of scalar programs as one machine-code loop: a member to each lane of the processor's vectors.

A batched JAX program on a CPU runs one small loop over all members after another, and every number between two of them
goes through the cache: a step of a wire is some hundred such loops. Here the same program, traced by JAX for *one* member,
becomes one loop over groups of members, few enough that all they need stays in the nearest cache from the first step to the
last, in phases (`phases`) that keep their results in registers.

jaxpr (`translate`) -> LLVM's language (`text`, `arithmetic`, `phases`) -> machine code, and threads that run it (`kernel`).
"""
