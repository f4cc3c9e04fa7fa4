"""Checks of numbers and packages: whatever comes from users' hands, and one kind of error."""

from __future__ import annotations

import warnings
from decimal import Decimal
from fractions import Fraction
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import ConfigError, MissingDependencyError
from cbagan_ompl.common.validation import (
    check_at_least,
    check_fraction,
    finite_number,
    is_finite_number,
    positive_number,
    require,
    require_torch,
    whole_number,
)


class Raising:
    """Raises in every conversion."""

    def __float__(self) -> float:
        raise KeyError

    def __index__(self) -> int:
        raise KeyError

    def __repr__(self) -> str:
        raise KeyError


def kind(value: object) -> str:
    """Return the name of a test's value: pytest cannot write out huge integers."""
    return type(value).__name__


NUMBERS: list[tuple[Any, float]] = [
    (2, 2.0),
    (-0.5, -0.5),
    (0, 0.0),
    (1e308, 1e308),
    (2**1000, float(2**1000)),
    (np.float32(0.5), 0.5),
    (np.float16(0.5), 0.5),
    (np.int8(-3), -3.0),
    (np.uint64(7), 7.0),
    (np.array(1.5), 1.5),
    (np.array(3), 3.0),
    (Decimal("0.25"), 0.25),
    (Fraction(1, 4), 0.25),
]

NO_NUMBERS: list[Any] = [
    *(None, "2", b"2", bytearray(b"2"), memoryview(b"2"), "", True, False),
    *(nan, inf, -inf, Decimal("nan"), Decimal("sNaN"), Decimal("inf"), Decimal("1e999")),
    *(10**400, -(10**5000), Fraction(10**5000), 1j, 1 + 0j, [1], (1,), {1}, {}, object(), int),
    *(np.nan, np.inf, np.True_, np.complex64(1), np.complex128(1 + 0j), np.str_("2")),
    *(np.timedelta64(3, "s"), np.datetime64("2026-01-01"), np.void(b"abc")),
    *(np.array([1.0]), np.array([]), np.array(1j), np.array("3"), np.array(True)),
    *(np.array(None), Raising()),
]


@pytest.mark.parametrize(("value", "number"), NUMBERS, ids=kind)
def test_numbers(value: Any, number: float) -> None:
    assert is_finite_number(value)
    found = finite_number("radius", value, -inf)
    assert type(found) is float
    assert found == number


@pytest.mark.parametrize("value", NO_NUMBERS, ids=kind)
def test_no_numbers(value: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not is_finite_number(value)
        for check in (
            lambda: finite_number("radius", value, -1.0),
            lambda: positive_number("radius", value),
            lambda: check_fraction("radius", value),
        ):
            with pytest.raises(ConfigError, match=r"^radius ") as caught:
                check()
            assert len(str(caught.value)) < 400


def test_bounds_of_numbers() -> None:
    assert finite_number("radius", 0, 0.0) == 0.0
    assert positive_number("time", 5e-324) == 5e-324
    assert positive_number("time", np.int64(2)) == 2.0
    with pytest.raises(ConfigError, match=r"radius is a finite number of at least 0, got -1e-300"):
        finite_number("radius", -1e-300, 0.0)
    for value in (0, 0.0, -0.0, -1):
        with pytest.raises(ConfigError, match=r"time must be above 0, got -?\d"):
            positive_number("time", value)


@pytest.mark.parametrize("value", [0, 1, 0.5, np.float32(1), Fraction(1, 3), 1e-300], ids=kind)
def test_fractions(value: Any) -> None:
    check_fraction("hard_fraction", value)


@pytest.mark.parametrize("value", [-1e-9, 1.0000001, 2, -(10**400), 10**5000], ids=kind)
def test_no_fractions(value: Any) -> None:
    with pytest.raises(ConfigError, match="hard_fraction is a fraction"):
        check_fraction("hard_fraction", value)


@pytest.mark.parametrize("value", [0, 3, np.int8(3), np.uint64(3), np.array(3), 2**63], ids=kind)
def test_whole_numbers(value: Any) -> None:
    found = whole_number("seed", value, 0)
    assert type(found) is int
    assert found == value


@pytest.mark.parametrize(
    "value",
    [
        *(-1, 1.0, "1", b"1", None, True, False, np.True_, nan, inf, 1j, [1], Decimal(1)),
        *(Fraction(2), np.float64(3), np.array([3]), np.array(3.0), -(10**5000), Raising()),
    ],
    ids=kind,
)
def test_no_whole_numbers(value: Any) -> None:
    with pytest.raises(ConfigError, match=r"^seed is a whole number of at least 0, got "):
        whole_number("seed", value, 0)


def test_largest_whole_number() -> None:
    assert whole_number("runs", 10, 1, most=10) == 10
    with pytest.raises(ConfigError, match=r"runs is a whole number of at least 1 and at most 10"):
        whole_number("runs", 11, 1, most=10)
    with pytest.raises(ConfigError, match="got <an integer of 16610 bits>"):
        whole_number("runs", 10**5000, 1)


def test_at_least() -> None:
    check_at_least("jobs", 1, 1)
    with pytest.raises(ConfigError, match=r"jobs must be at least 1, got 0"):
        check_at_least("jobs", 0, 1)
    with pytest.raises(ConfigError, match="got <an integer of 16610 bits>"):
        check_at_least("jobs", -(10**5000), 1)


def test_packages() -> None:
    require("numpy", "torch")
    with pytest.raises(MissingDependencyError) as caught:
        require("no_such_package_at_all", "torch")
    assert "this needs no_such_package_at_all, which cannot be imported" in str(caught.value)
    assert "in the clone of cbagan-ompl with: pip install -e '.[torch]'" in str(caught.value)


def test_torch_is_named_where_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    with pytest.raises(MissingDependencyError, match=r"this needs torch.*in the clone.*\[torch\]"):
        require_torch()
