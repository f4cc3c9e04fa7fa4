"""Functions that numba compiles on their first call.

They are kept on disk, beside the package or in the user's cache, so that later processes load them.
Modules with such functions are imported where they are first used: numba takes a third of a second.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function, *, signature: str | None = None) -> Function:
    """Return a function as numba compiles it (https://numba.readthedocs.io).

    Other threads run meanwhile.

    Args:
        function: of numbers and arrays.
        signature: the types that it takes; by default those of each call.

    Example:
        >>> def successor(x: int) -> int:
        ...     return x + 1
        >>> compiled(successor)(2)
        3
    """
    try:
        result = njit(signature, cache=True, nogil=True)(function)
    except RuntimeError:  # no folder in which it may be kept
        result = njit(signature, nogil=True)(function)
    return cast(Function, result)
