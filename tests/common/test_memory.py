from __future__ import annotations

import cv2
import numpy as np
import pytest

from cbagan_ompl import ConfigError, ModelError
from cbagan_ompl.common.memory import is_out_of_memory, translate_lack_of_memory


def _allocate(kind: str) -> object:
    if kind == "numpy":
        return np.empty(2**60, np.uint8)
    if kind == "python":
        return bytearray(2**60)
    if kind == "cv2":
        return cv2.resize(np.zeros((9, 9), np.uint8), (2**30, 2**24))
    return pytest.importorskip("torch").empty(2**60)


@pytest.mark.parametrize("kind", ["numpy", "python", "cv2", "torch"])
def test_lack_of_memory_of_every_library_is_one_error(kind: str) -> None:
    with (
        pytest.raises(ModelError, match="not enough memory to do it: do less"),
        translate_lack_of_memory(ModelError, "to do it", "do less"),
    ):
        _allocate(kind)


@pytest.mark.parametrize(
    "error",
    [RuntimeError("shapes differ"), OSError(28, "No space left"), ConfigError("not enough memory")],
)
def test_other_errors_stay(error: Exception) -> None:
    assert not is_out_of_memory(error)
    with (
        pytest.raises(type(error)) as caught,
        translate_lack_of_memory(ModelError, "to do it", "do less"),
    ):
        raise error
    assert caught.value is error
