"""The learned side: networks, training, export and prediction. Nothing else imports torch."""

from __future__ import annotations

from ..checks import require


def require_torch() -> None:
    """Check that torch is installed.

    Raises:
        MissingDependencyError: it is not; the message says how to install it.
    """
    require("torch", "torch")
