"""Functions that numba compiles."""

from __future__ import annotations

from typing import Any

from cbagan_ompl.common.compilation import compiled


def test_what_cannot_be_kept_on_disk_is_compiled_all_the_same() -> None:
    names: dict[str, Any] = {}
    exec("def twice(x):\n    return 2 * x", names)  # of no file, beside which it could be kept
    twice = compiled(names["twice"])
    assert (twice(4), twice(0.5)) == (8, 1.0)


def test_signatures_convert_arguments() -> None:
    def half(x: float) -> float:
        return x / 2

    assert compiled(half, signature="float64(float64)")(3) == 1.5
