"""Samplers of a benchmark by their names: ``learned``, or ``learned:adaptation=none``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from ..errors import ConfigError, show
from ..sampling.options import Adaptation, SamplerOptions

# They name planners in OMPL's logs and series in plots, where a leading "_" would hide them.
_NAME = re.compile(r"[^\W_].{0,79}")


@dataclass(frozen=True)
class SamplerVariant:
    """A source of heat maps, and how it is sampled where that differs from the other samplers.

    Attributes:
        name: the whole text, which names the sampler in logs, tables and plots.
        source: what is before the colon: one of :data:`.SAMPLERS`, a model or a folder.
        changes: value by field of :class:`.SamplerOptions`, as pairs.
    """

    name: str
    source: str
    changes: tuple[tuple[str, Any], ...] = ()


def parse_sampler(text: str) -> SamplerVariant:
    """Return the sampler that a text names.

    Args:
        text: ``SOURCE``, or ``SOURCE:OPTION=VALUE``, with more options after further colons.
            Options are ``adaptation`` (rules with ``+`` between them, or ``none``), ``sharpness``
            and ``uniform_fraction``.

    Raises:
        ConfigError: a text of another form, an unknown option, or a value that makes no sense.

    Example:
        >>> parse_sampler("learned:adaptation=coverage+stagnation:sharpness=2").changes
        (('adaptation', Adaptation(connectivity=False, coverage=True, stagnation=True)), \
('sharpness', 2.0))
    """
    if not (isinstance(text, str) and _NAME.fullmatch(text) and text.isprintable()):
        raise ConfigError(
            "the name of a sampler has up to 80 printable characters and begins with a letter or "
            f"digit, got {show(text)}"
        )
    source, *assignments = text.split(":")
    changes: dict[str, Any] = {}
    for assignment in assignments:
        option, equals, value = assignment.partition("=")
        if not equals or option not in _READERS or option in changes:
            raise ConfigError(
                f"sampler {show(text)}: expected SAMPLER:OPTION=VALUE, each option once, with "
                f"OPTION one of {', '.join(_READERS)}"
            )
        changes[option] = value
    try:
        changes = {option: _READERS[option](value) for option, value in changes.items()}
        SamplerOptions.of(None, changes)
    except ConfigError as error:
        raise ConfigError(f"sampler {show(text)}: {error}") from error
    return SamplerVariant(text, source, tuple(changes.items()))


def _read_number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text  # refused with the option's own message


def _read_adaptation(text: str) -> Adaptation:
    return Adaptation.of(() if text == "none" else text.split("+"))


_READERS = {
    "adaptation": _read_adaptation,
    "sharpness": _read_number,
    "uniform_fraction": _read_number,
}
