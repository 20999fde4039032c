"""The two kinds of compiled functions: a kernel, which Python calls, and a part, which kernels call.

Of a part there is no machine code and no way in from Python, which halves what the compiler has to do for it. It
can be called from Python all the same, for a test or a look: then it is compiled once more as a kernel. Which kind
a function of the program has to be is held by a test. Both are kept in the cache.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from types import FunctionType
from typing import Any, Final, TypeVar, cast

from numba import njit
from numba.core.registry import CPUDispatcher

from tcrctl.numerics.late_code import make_code_late

make_code_late()

#: Options that change what a kernel does.
_KEPT: Final = ("error_model", "fastmath", "nogil", "inline")

_njit: Any = njit  # it wants every option by name
F = TypeVar("F", bound=Callable[..., Any])


def kernel(**options: Any) -> Callable[[F], F]:
    """Return the decorator of a function that Python calls, and other kernels may.

    Args:
        options: Of :func:`numba.njit`.
    """
    return cast(Callable[[F], F], _njit(cache=True, no_cfunc_wrapper=True, **options))


def part(**options: Any) -> Callable[[F], F]:
    """Return the decorator of a function that only kernels call.

    Args:
        options: Of :func:`numba.njit`.
    """

    def decorate(function: F) -> F:
        made: Any = _njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)(function)
        if isinstance(made, CPUDispatcher):  # else the compiler is switched off
            made.__class__ = Part  # numba has no option for it
        return cast(F, made)

    return decorate


class Part(CPUDispatcher):  # type: ignore[misc,unused-ignore]
    """A function that kernels call."""

    def __call__(self, *arguments: Any) -> Any:
        """Compile it as a kernel, under a name of its own in the cache, and call that."""
        return self._from_python(*arguments)

    @cached_property
    def _from_python(self) -> Any:
        inner = self.py_func
        function = FunctionType(inner.__code__, inner.__globals__, inner.__name__, inner.__defaults__)
        function.__module__, function.__qualname__ = inner.__module__, f"{inner.__qualname__}.from_python"
        options = {name: self.targetoptions[name] for name in _KEPT if name in self.targetoptions}
        return kernel(**options)(function)
