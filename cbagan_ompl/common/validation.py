"""Checks of options that several commands have."""

from __future__ import annotations

from importlib import import_module

from ..errors import ConfigError, MissingDependencyError


def check_at_least(name: str, value: int, least: int) -> None:
    """Refuse a number that is too small.

    Raises:
        ConfigError: it is below ``least``; the message has the name of the option.
    """
    if value < least:
        raise ConfigError(f"{name} must be at least {least}, got {value}")


def check_fraction(name: str, value: float) -> None:
    """Refuse a number that is no share of anything.

    Raises:
        ConfigError: it is below 0, above 1 or NaN; the message has the name of the option.
    """
    if not 0 <= value <= 1:
        raise ConfigError(f"{name} is a share from 0 to 1, got {value}")


def require(package: str, extra: str) -> None:
    """Check that an optional package is installed.

    Args:
        package: its name.
        extra: of this package, that brings it.

    Raises:
        MissingDependencyError: it cannot be imported; the message says how to install it.
    """
    try:
        import_module(package)
    except ImportError as error:
        raise MissingDependencyError(
            f"this needs {package}, which cannot be imported ({error}); "
            f"install it with: pip install 'cbagan-ompl[{extra}]'"
        ) from error


def require_torch() -> None:
    """Check that torch is installed.

    Raises:
        MissingDependencyError: it is not; the message says how to install it.
    """
    require("torch", "torch")
