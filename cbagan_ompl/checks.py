"""Checks of options that several commands have."""

from __future__ import annotations

from .errors import ConfigError


def check_at_least(name: str, value: int, least: int) -> None:
    """Refuse a number that is too small.

    Raises:
        ConfigError: it is below ``least``; the message has the name of the option.
    """
    if value < least:
        raise ConfigError(f"{name} must be at least {least}, got {value}")
