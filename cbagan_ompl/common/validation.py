"""Checks of numbers and of optional packages: one place that decides, one kind of error."""

from __future__ import annotations

from importlib import import_module
from math import inf, isfinite, nan
from operator import index
from typing import SupportsIndex

import numpy as np

from ..errors import ConfigError, MissingDependencyError, show

# What NumPy recommends for seeds has 128 bits.
_LARGEST_SEED = 2**128


def finite_number(name: str, value: float, least: float) -> float:
    """Return a number as a float.

    Args:
        name: of the option, for the message.
        value: any real number; a text or a truth value is none.
        least: smallest number that is allowed.

    Raises:
        ConfigError: the value is no finite number, or below ``least``.

    Example:
        >>> finite_number("radius", 2, 0.0)
        2.0
    """
    number = to_float(value)
    if not (isfinite(number) and number >= least):
        raise ConfigError(f"{name} is a finite number of at least {least:g}, got {show(value)}")
    return number


def positive_number(name: str, value: float) -> float:
    """Return a number above 0 as a float; arguments and errors as for :func:`finite_number`."""
    number = to_float(value)
    if not (isfinite(number) and number > 0):
        raise ConfigError(f"{name} must be above 0, got {show(value)}")
    return number


def whole_number(name: str, value: SupportsIndex, least: int, most: int = 2**63) -> int:
    """Return a whole number as an int.

    Args:
        name: of the option, for the message.
        value: an int or a NumPy integer; a truth value is none.
        least: smallest number that is allowed.
        most: largest number that is allowed.

    Raises:
        ConfigError: the value is no whole number, or out of range.
    """
    try:
        number = index(value)
    except Exception:  # whatever the class of the value raises
        number = least - 1
    if number < least or number > most or isinstance(value, bool):
        limit = f" and at most {most}" if number > most else ""
        raise ConfigError(f"{name} is a whole number of at least {least}{limit}, got {show(value)}")
    return number


def truth_value(name: str, value: bool) -> bool:
    """Return a truth value as a bool.

    Args:
        name: of the option, for the message.
        value: a bool, NumPy's included.

    Raises:
        ConfigError: the value is none.
    """
    if not isinstance(value, bool | np.bool_):
        raise ConfigError(f"{name} is True or False, got {show(value)}")
    return bool(value)


def check_at_least(name: str, value: int, least: int) -> None:
    """Raise if a number is too small.

    Args:
        name: of the option, for the message.
        value: the number.
        least: smallest number that is allowed.

    Raises:
        ConfigError: it is below ``least``; the message has the name of the option.
    """
    if value < least:
        raise ConfigError(f"{name} must be at least {least}, got {show(value)}")


def check_fraction(name: str, value: float) -> None:
    """Raise if a number is not between 0 and 1.

    Args:
        name: of the option, for the message.
        value: the number.

    Raises:
        ConfigError: it is no number, below 0, above 1 or NaN; the message has the name of the
            option.
    """
    if not 0 <= to_float(value) <= 1:
        raise ConfigError(f"{name} is a fraction from 0 to 1, got {show(value)}")


def is_finite_number(value: object) -> bool:
    """Return whether a value is a finite real number: no text, no truth value, no array."""
    return isfinite(to_float(value))


def to_float(value: object) -> float:
    """Return a number as a float; NaN where it is none, infinity where it is too large for one.

    Texts, truth values and arrays are no numbers. Nothing is raised, whatever the value is.

    Example:
        >>> to_float(2), to_float("2")
        (2.0, nan)
    """
    if isinstance(value, str | bytes | bytearray | memoryview | bool):
        return nan
    if isinstance(value, np.ndarray | np.generic) and (
        value.ndim > 0 or value.dtype.kind not in "iuf"
    ):
        return nan
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        return inf
    except Exception:  # whatever the class of the value raises
        return nan


def random_generator(seed: SupportsIndex | np.random.Generator | None) -> np.random.Generator:
    """Return the generator of a seed: a new one for a whole number, itself for a generator.

    Args:
        seed: a whole number of at least 0, or a generator; None for one that nobody can repeat.

    Raises:
        ConfigError: neither of them.

    Example:
        >>> random_generator(1).random() == random_generator(1).random()
        True
    """
    return np.random.default_rng(check_seed(seed))


def check_seed(
    seed: SupportsIndex | np.random.Generator | None,
) -> int | np.random.Generator | None:
    """Return a seed, a NumPy integer as an int; arguments and errors as for `random_generator`."""
    if seed is None or isinstance(seed, np.random.Generator):
        return seed
    return whole_number("seed", seed, 0, _LARGEST_SEED)


def require(package: str, extra: str) -> None:
    """Raise if an optional package is not installed.

    Args:
        package: its name.
        extra: of this package, that brings it.

    Raises:
        MissingDependencyError: it cannot be imported; the message says how to install it.
    """
    try:
        import_module(package)
    except (ImportError, OSError) as error:  # OSError for a library that is not there
        raise MissingDependencyError(
            f"this needs {package}, which cannot be imported ({error}); "
            f"install it in the clone of cbagan-ompl with: pip install -e '.[{extra}]'"
        ) from error


def require_torch() -> None:
    """Raise if torch is not installed.

    Raises:
        MissingDependencyError: it is not; the message says how to install it.
    """
    require("torch", "torch")
