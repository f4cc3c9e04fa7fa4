"""Masks as bits, the runs of true values in their rows, and the components of runs."""

from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl.common.bit_runs import cut_bits, find_runs, join_runs, pack_rows
from cbagan_ompl.maps.connectivity import label_components


@pytest.mark.parametrize("shape", [(1, 1), (5, 64), (70, 65), (20, 200)])
@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.6, 1.0])
def test_runs_and_their_components_are_those_of_the_pixels(
    shape: tuple[int, int], fraction: float
) -> None:
    mask = np.random.default_rng(0).random(shape) < fraction
    begins, ends, roots = np.zeros((3, mask.size + 1), np.int32)
    firsts = np.zeros(len(mask) + 1, np.int32)
    count = find_runs(pack_rows(mask), begins, ends, firsts)
    join_runs(begins, ends, firsts, roots)
    assert count == firsts[-1] == (np.diff(np.pad(mask, ((0, 0), (1, 0))).astype(int)) > 0).sum()
    found = np.zeros(shape, np.int32)
    for row in range(len(mask)):
        for run in range(firsts[row], firsts[row + 1]):
            found[row, begins[run] : ends[run]] = roots[run] + 1
    assert np.array_equal(found > 0, mask)
    labels = label_components(mask, connectivity=4)
    pairs = np.unique(np.stack((labels.ravel(), found.ravel())), axis=1)
    assert pairs.shape[1] == len(np.unique(labels)) == len(np.unique(found))


@pytest.mark.parametrize(("begin", "end"), [(0, 1), (3, 64), (60, 130), (63, 64), (64, 199)])
def test_bits_are_cut_out_wherever_words_begin(begin: int, end: int) -> None:
    mask = np.random.default_rng(1).random((5, 199)) < 0.5
    part = np.zeros((3, -(-(end - begin) // 64)), np.uint64)
    cut_bits(pack_rows(mask), 1, begin, end, part)
    assert part.tolist() == pack_rows(mask[1:4, begin:end]).tolist()
