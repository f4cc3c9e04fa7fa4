"""Damaged files: seeded mutations of valid ones, and what a reader makes of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from cbagan_ompl.errors import CbaganOmplError

# Bytes at which parsers tend to fail: ends of ranges, signs, and what separates tokens.
_ODD = bytes([0, 1, 9, 10, 13, 32, 34, 39, 44, 45, 47, 58, 92, 127, 128, 254, 255])


def mutations(valid: Sequence[bytes], count: int, seed: int) -> Iterator[bytes]:
    """Yield damaged variants of some valid files; the same seed gives the same variants."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        data = valid[i % len(valid)]
        for _ in range(int(rng.choice((1, 1, 1, 2, 4, 16)))):
            data = mutate(data, rng, valid)
        yield data


def mutate(data: bytes, rng: np.random.Generator, others: Sequence[bytes] = ()) -> bytes:
    """Return bytes with one damage of a kind chosen at random."""
    first, last = sorted(rng.integers(len(data) + 1, size=2).tolist())
    last = min(last, first + int(2 ** rng.uniform(0, 10)))
    kind = rng.integers(8)
    if kind == 0 and first < len(data):  # one bit
        flipped = data[first] ^ (1 << int(rng.integers(8)))
        return data[:first] + bytes([flipped]) + data[first + 1 :]
    if kind == 1:  # a few bytes that are often special
        odd = bytes(rng.choice(list(_ODD), size=int(rng.integers(1, 5))).tolist())
        return data[:first] + odd + data[first + len(odd) :]
    if kind == 2:
        return data[:first] + rng.bytes(last - first) + data[last:]
    if kind == 3:  # insert
        return data[:first] + rng.bytes(int(rng.integers(1, 9))) + data[first:]
    if kind == 4:  # delete
        return data[:first] + data[last:]
    if kind == 5:  # duplicate
        return data[:last] + data[first:last] * int(rng.integers(1, 4)) + data[last:]
    if kind == 6:  # truncate
        return data[:first]
    other = others[int(rng.integers(len(others)))] if others else data
    cut = int(rng.integers(len(other) + 1))  # splice
    return data[:first] + other[cut:]


def read_all(read: Callable[[bytes], object], inputs: Iterator[bytes]) -> Counter[str]:
    """Return how many inputs were read and refused; any foreign exception fails the test.

    Messages must be short, as users are to read them.
    """
    counts: Counter[str] = Counter()
    for number, data in enumerate(inputs):
        try:
            read(data)
        except CbaganOmplError as error:
            assert 0 < len(str(error)) < 1000, f"input {number}: {error}"
            counts["refused"] += 1
        except BaseException as error:
            raise AssertionError(f"input {number}, {data[:200]!r}: {error!r}") from error
        else:
            counts["read"] += 1
    return counts
