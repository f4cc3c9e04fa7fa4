"""The learned side: networks, training, export and prediction. Nothing else imports torch."""

from __future__ import annotations

from importlib import import_module

from ..errors import MissingDependencyError


def require_torch() -> None:
    """Check that the optional packages of this sub-package are installed.

    Raises:
        MissingDependencyError: one is not; the message says how to install it.
    """
    for name in ("torch", "tqdm"):
        try:
            import_module(name)
        except ImportError as error:
            raise MissingDependencyError(
                f"the learned sampler needs {name}, which cannot be imported ({error}); "
                "install it with: pip install 'cbagan-ompl[torch]'"
            ) from error
