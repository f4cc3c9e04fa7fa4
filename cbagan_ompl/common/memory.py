"""What libraries raise when memory is used up: many types, which users read as one."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import CbaganOmplError

# Of NumPy and Python, torch (by device), C++ below them, and OpenCV.
_CLASSES = {"MemoryError", "OutOfMemoryError"}
_TEXTS = re.compile(
    r"can't allocate memory|not enough memory|out of memory|bad_alloc|insufficient memory|"
    r"cannot allocate memory",
    re.IGNORECASE,
)


def is_out_of_memory(error: BaseException) -> bool:
    """Return whether an exception says that memory is used up.

    Example:
        >>> is_out_of_memory(MemoryError()), is_out_of_memory(RuntimeError("CUDA out of memory"))
        (True, True)
        >>> is_out_of_memory(RuntimeError("shapes differ"))
        False
    """
    names = {cls.__name__ for cls in type(error).__mro__}
    return bool(names & _CLASSES) or (
        not isinstance(error, CbaganOmplError) and _TEXTS.search(str(error)) is not None
    )


@contextmanager
def translate_lack_of_memory(
    error_class: type[CbaganOmplError], what: str, cure: str
) -> Iterator[None]:
    """Raise a clear error where memory is used up.

    Args:
        error_class: what to raise.
        what: could not be done, for the message.
        cure: what to do about it.

    Raises:
        CbaganOmplError: of that class.
    """
    try:
        yield
    except Exception as error:
        if not is_out_of_memory(error):
            raise
        raise error_class(f"not enough memory {what}: {cure}") from error
