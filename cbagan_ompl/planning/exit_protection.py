"""Keeping OMPL 1.7 from crashing the interpreter at its exit; nothing is imported for it.

``ompl.util`` of the wheel 1.7.0 preloads a second copy of libompl. Its static objects are then
destroyed twice, and the process ends with a segmentation fault after its work is done. OMPL 2.0
does no such thing, and is left alone.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any


def protect_exit() -> None:
    """Let the interpreter end with its own exit status, whatever of OMPL is or will be imported.

    Before ``ompl.util`` is imported, its second copy can be avoided; afterwards only the
    destructors of both copies can be skipped, which needs glibc.
    """
    if "ompl.util" not in sys.modules:
        sys.meta_path.insert(0, _LoaderPatch())
    elif hasattr(sys.modules["ompl"], "dll_loader"):
        _skip_static_destructors()


class _LoaderPatch(MetaPathFinder):
    """Finds nothing, but sees ``ompl.util`` come, and takes the preloading away before it."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return None: the ordinary finders go on."""
        if fullname == "ompl.util":
            sys.meta_path.remove(self)
            ompl: Any = sys.modules["ompl"]
            if hasattr(ompl, "dll_loader"):
                # The first copy, which the extension modules bring, is all that is needed.
                ompl.dll_loader = lambda *_: None
        return None


def _skip_static_destructors() -> None:
    """Leave the process right after Python's own shutdown, with its exit status.

    glibc calls the handlers last in, first out: C streams are flushed, then ``_exit(status)``.
    """
    libc = ctypes.CDLL(None)
    if hasattr(libc, "on_exit"):
        for handler in ("_exit", "fcloseall"):
            libc.on_exit(ctypes.cast(getattr(libc, handler), ctypes.c_void_p), None)
