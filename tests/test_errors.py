"""The exceptions: one root, short messages that a terminal can show, and values in them."""

from __future__ import annotations

import pickle
from collections import OrderedDict
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import cbagan_ompl
from cbagan_ompl import errors
from cbagan_ompl.errors import CbaganOmplError, CbaganOmplWarning, MapError, show

CLASSES = [
    value
    for value in vars(errors).values()
    if isinstance(value, type) and issubclass(value, Exception) and not issubclass(value, Warning)
]


def test_every_class_has_one_root_and_is_public() -> None:
    assert len(CLASSES) == 11
    for one in CLASSES:
        assert issubclass(one, CbaganOmplError)
        assert getattr(cbagan_ompl, one.__name__) is one


def test_warnings_are_shown_as_errors_are() -> None:
    assert issubclass(CbaganOmplWarning, UserWarning)
    assert cbagan_ompl.CbaganOmplWarning is CbaganOmplWarning
    assert str(CbaganOmplWarning("map \x1b")) == str(MapError("map \x1b")) == r"map \x1b"


def test_short_messages_stay_as_they_are() -> None:
    for message in ("", "no map", "two\nlines", "größer als ∞ 地図", "x" * 900):
        assert str(MapError(message)) == message


@pytest.mark.parametrize(
    "character",
    ["x", "\n", "\x1b", "\0", "\u202e", "\ud800", "\U0010fffe", "é"],
    ids=lambda c: ascii(c)[1:-1],
)
@pytest.mark.parametrize("length", [899, 900, 901, 10_000, 10**6])
def test_messages_are_short_and_harmless(character: str, length: int) -> None:
    message = str(MapError("begin " + character * length + " end"))
    assert len(message) < 1000
    assert message.startswith("begin ")
    assert message.endswith(" end")
    assert message.replace("\n", "").isprintable()
    message.encode("utf-8")


def test_messages_survive_processes() -> None:
    for message in ("short", "\x1b[31m" * 500, "long " * 10_000):
        error = MapError(message)
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is MapError
        assert str(again) == str(error)


def test_control_characters_are_written_as_escapes() -> None:
    assert str(MapError("a\x1b[31mb\tc\rd\ud800")) == r"a\x1b[31mb\tc\rd\ud800"


def kind(value: object) -> str:
    return type(value).__name__


class Hostile:
    """Raises whatever is asked of it."""

    def __repr__(self) -> str:
        raise RuntimeError


class Verbose:
    def __repr__(self) -> str:
        return "v" * 10**6


# A class that reprlib would take for Python's own.
Disguised = type("int", (), {})


def nested(depth: int) -> list[Any]:
    value: list[Any] = []
    for _ in range(depth):
        value = [value] * 9
    return value


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ("maze.png", "'maze.png'"),
        (3, "3"),
        (-1.5, "-1.5"),
        (None, "None"),
        (True, "True"),
        (10**30, str(10**30)),
        (10**5000, "<an integer of 16610 bits>"),
        ([10**5000], "[<an integer of 16610 bits>]"),
        (b"abc", "b'abc'"),
        (b"x" * 10**7, "<10000000 bytes>"),
        (bytearray(300), "<300 bytes>"),
        (Fraction(10**5000), "<Fraction"),
        (Decimal("1e99"), "Decimal('1E+99')"),
        (Hostile(), "<Hostile"),
        (Disguised(), "<int>"),
        ({"a": [1, (2,)]}, "{'a': [1, (2,)]}"),
        (np.float64(2), "np.float64(2.0)"),
    ],
    ids=kind,
)
def test_values_are_shown(value: object, shown: str) -> None:
    assert show(value).startswith(shown)


@pytest.mark.parametrize(
    "value",
    [
        "x" * 10**6,
        list(range(10**6)),
        dict.fromkeys(range(10**5)),
        OrderedDict.fromkeys(range(10**4)),
        set(range(10**5)),
        nested(12),
        np.zeros((300, 300)),
        np.arange(10**6),
        Verbose(),
        [[b"x" * 10**6] * 100] * 100,
    ],
    ids=kind,
)
def test_what_is_shown_is_short(value: object) -> None:
    assert len(show(value)) < 3000
    assert len(str(MapError(f"got {show(value)}"))) < 1000


def test_a_value_that_holds_itself_is_shown() -> None:
    value: list[Any] = []
    value.append(value)
    assert "..." in show(value)
