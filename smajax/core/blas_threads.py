"""Linear algebra on one thread, beside programs that take all cores.

The matrices of a fit are small. A second thread of OpenBLAS gains nothing on them, and waits for the next one without giving its core away:
on two cores the attribution of the bias-spring bench took 89 s with it and 76 s without.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

Given = ParamSpec("Given")
Result = TypeVar("Result")


def on_one_blas_thread(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """`function`, during which BLAS has one thread; afterwards as many as before."""

    @wraps(function)
    def limited(*arguments: Given.args, **named: Given.kwargs) -> Result:
        # Now and not when the module is imported: a library that is not loaded then would not be limited.
        with threadpool_limits(limits=1, user_api="blas"):
            return function(*arguments, **named)

    return limited
