"""Values that are wrong in most places, for tests of misuse."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from cbagan_ompl import Adaptation, CbaganOmplError, GridMap, Heatmap, SamplerOptions, Task

GRID = GridMap(np.ones((24, 24), np.bool_), name="empty")
START, GOAL = (2.5, 2.5), (20.5, 20.5)
HEATMAP = Heatmap.uniform(GRID)


class Hostile:
    """Raises whatever it is asked."""

    def __getattr__(self, name: str) -> Any:
        raise RuntimeError(name)

    def __float__(self) -> float:
        raise RuntimeError("float")

    def __index__(self) -> int:
        raise RuntimeError("index")

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise RuntimeError("array")

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("eq")

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        raise RuntimeError("repr")


#: Values that are wrong in most places, by what they are called in the names of the tests.
POOL: dict[str, Any] = {
    "none": None,
    "true": True,
    "zero": 0,
    "five": 5,
    "minus": -1,
    "huge": 10**400,
    "longer": 10**5000,
    "half": 1.5,
    "tiny": 1e-300,
    "large": 1e300,
    "nan": float("nan"),
    "inf": float("inf"),
    "complex": 1 + 2j,
    "decimal": Decimal("1.5"),
    "fraction": Fraction(3, 2),
    "decimal-nan": Decimal("nan"),
    "text": "x",
    "number-text": "1",
    "empty-text": "",
    "nul": "a\0b",
    "surrogate": "\udc80",
    "bytes": b"x",
    "path": Path("/nonexistent/x.png"),
    "folder": Path("/"),
    "list": [],
    "nested": [[[1]]],
    "ragged": [[1, 2], [3]],
    "dict": {"a": 1},
    "set": {1},
    "pair": (3.0, 3.0),
    "triple": (1.0, 2.0, 3.0),
    "ones": np.ones((24, 24)),
    "bits": np.ones((24, 24), np.bool_),
    "other-shape": np.ones((3, 5)),
    "empty-array": np.empty((0, 2)),
    "objects": np.array([[None, "x"]], dtype=object),
    "object-zero": np.array(None, dtype=object),
    "dates": np.array(["2020-01-01"], dtype="datetime64[D]"),
    "records": np.zeros(3, dtype=[("a", "f8"), ("b", "i4")]),
    "strings": np.array([["1", "2"]]),
    "int8": np.int8(1),
    "float16": np.float16(0.5),
    "generator": np.random.default_rng(0),
    "class": int,
    "function": len,
    "hostile": Hostile(),
    "module": np,
    "grid": GRID,
    "heatmap": HEATMAP,
    "options": SamplerOptions(),
    "adaptation": Adaptation(),
    "task": Task(START, GOAL),
    "error": CbaganOmplError("x"),
}
