"""Versions of what decides on results: machines that work together need the same ones."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version

import cv2
import numpy as np
import scipy

from .. import __version__


@cache
def ompl_version() -> str:
    """Return the version of the installed OMPL package; "unknown" for a build without metadata."""
    try:
        return version("ompl")
    except PackageNotFoundError:
        return "unknown"


def versions() -> dict[str, str]:
    """Return the versions of this package, and of those that random maps and samples depend on.

    Example:
        >>> list(versions())
        ['cbagan-ompl', 'OMPL', 'NumPy', 'SciPy', 'OpenCV']
    """
    return {
        "cbagan-ompl": __version__,
        "OMPL": ompl_version(),
        "NumPy": np.__version__,
        "SciPy": scipy.__version__,
        "OpenCV": cv2.__version__,
    }
