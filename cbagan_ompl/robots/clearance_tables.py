"""For each range of headings, how far a shape may move from each pixel; made when needed."""

from __future__ import annotations

from math import ceil, pi

import cv2
import numpy as np
from numpy.typing import NDArray

from .pixel_shape import PixelShape, rotate

Points = NDArray[np.float64]

#: Values of a table: every pose with its reference point in the pixel and its heading in the range
#: touches an obstacle; some may; from FREE on none does, and the shape may move
#: ``(value - FREE) * STEP`` pixels in any direction without touching one.
BLOCKED, UNKNOWN, FREE = 0, 1, 2
#: From here on the shape is at least a STEP away from obstacles.
CLEAR = FREE + 1
#: Unit of the values of a table, in pixels.
STEP = 0.25

# Tables of one map take at most this many bytes, where that allows for the fewest headings.
_MOST_BYTES = 90_000_000
_FEWEST_HEADINGS, _MOST_HEADINGS = 16, 64
# A range of headings turns no point of the shape farther than this to either side: pixels, or as a
# fraction of the radius of a large shape.
_TURN, _TURN_FRACTION = 0.35, 0.05

# Slack for the rounding of coordinates and headings, in pixels.
_ROUNDING = 1e-6

# A table takes as long to make as about so many exact checks.
USES = 40

# From the centre of a pixel to its corner.
_HALF_DIAGONAL = 2**-0.5


class ClearanceTables:
    """Lower bounds of the clearance of a shape, for each pixel and each range of headings.

    A shape covers pixels; its clearance is at least the smallest distance of one of them to an
    obstacle. So a table is an erosion of the distance transform of the map by the pixels that
    the shape may cover, wherever in the pixel and whatever in the range the pose is. An erosion
    of the free space by those that it covers for certain says where it collides for certain.

    Args:
        free: (H, W), true where free; what lies outside is blocked.
        shape: in pixels.
    """

    def __init__(self, free: NDArray[np.bool_], shape: PixelShape) -> None:
        self._shape = shape
        self.count = _count_headings(free.size, shape)
        reach = ceil(shape.radius) + 3
        centres, distances = _distances(free)
        self._distances = _RowErosion(_quantize(distances, free), reach, UNKNOWN)
        self._free = _RowErosion(np.where(free, 255, BLOCKED).astype(np.uint8), reach, BLOCKED)
        # An obstacle this near to the centre of the pixel is in the shape at any heading, wherever
        # in the pixel the reference point is.
        blocked = centres <= (shape.inscribed - (_HALF_DIAGONAL - 0.5) if shape.inscribed else 0.0)
        any_heading = _quantize(distances - shape.radius, free)
        any_heading[blocked] = BLOCKED
        # Memory is taken up only by the tables that are made: the first one for all headings, then
        # one for each range of them.
        self.stack = np.empty((self.count + 1, free.size), np.uint8)
        self.stack[0] = any_heading.reshape(-1)
        #: The row of the stack for each range of headings, over four full turns, so that sums of
        #: headings need no reduction; then how often the table of each range did not know.
        self.counts = np.zeros(5 * self.count, np.int64)
        self.slots, self.uses = self.counts[: 4 * self.count], self.counts[4 * self.count :]
        #: The tables in the order of the slots.
        self.by_heading = [memoryview(self.stack[0])] * (4 * self.count)

    def refine(self, index: int) -> bool:
        """Note that a table did not know; return whether a better one has taken its place.

        At first every range of headings has the table of all headings. Its own is made when it
        was missed so often that it is worth its time.

        Args:
            index: of the range, as in ``by_heading``.
        """
        index %= self.count
        self.uses[index] += 1
        if self.uses[index] != USES:
            return False
        self.make(index)
        return True

    def make(self, index: int) -> None:
        """Make the table of a range of headings."""
        self.stack[index + 1] = self._make(index)
        table = memoryview(self.stack[index + 1])
        for turn in range(4):
            self.slots[turn * self.count + index] = index + 1
            self.by_heading[turn * self.count + index] = table

    def _make(self, index: int) -> NDArray[np.uint8]:
        half = pi / self.count if self._shape.turns else 0.0
        values, certain = [], []
        for part in self._shape.parts:
            touched, inside = _covered_pixels(rotate(part, (2 * index + 1) * half), half)
            values.append(self._distances.erode(touched))
            certain.append(self._free.erode(inside))
        # What the shape covers for certain blocks it; free is marked by 255.
        return np.asarray(np.minimum.reduce([*values, *certain])).reshape(-1)


class _RowErosion:
    """Erosions of one image by sets of pixels, row by row of the set.

    The least value of 1, 2, 4, ... pixels in a row is made once, so a run of any length takes two
    look-ups; M. van Herk, "A fast algorithm for local minimum and maximum filters on rectangular
    and octagonal kernels", Pattern Recognition Letters 13 (1992), has the idea for rectangles.
    """

    def __init__(self, image: NDArray[np.uint8], reach: int, outside: int) -> None:
        padded = np.pad(image, reach, constant_values=outside)
        self._shape, self._reach, self._stride = image.shape, reach, padded.shape[1]
        # Flat, so that a shift in both directions is one. Of the ends of rows that run into the
        # next row by that, none is in the image.
        self._minima = [padded.reshape(-1)]
        self._first = reach * self._stride + reach
        self._length = (image.shape[0] - 1) * self._stride + image.shape[1]

    def erode(self, runs: list[tuple[int, int, int]]) -> NDArray[np.uint8]:
        """Return the least value at some offsets from each pixel, of the shape of the image.

        Args:
            runs: offsets as (row, first column, last column).
        """
        least = np.full(self._shape[0] * self._stride, 255, np.uint8)
        view = least[: self._length]
        for row, first, last in runs:
            level = (last - first + 1).bit_length() - 1
            minima = self._minima_of(level)
            for column in {first, last + 1 - 2**level}:
                start = self._first + row * self._stride + column
                np.minimum(view, minima[start : start + self._length], out=view)
        return least.reshape(self._shape[0], self._stride)[:, : self._shape[1]]

    def _minima_of(self, level: int) -> NDArray[np.uint8]:
        """Return the least of the 2**level pixels from each one to the right."""
        while len(self._minima) <= level:
            shift = 2 ** (len(self._minima) - 1)
            last = self._minima[-1]
            following = last.copy()
            np.minimum(last[:-shift], last[shift:], out=following[:-shift])
            self._minima.append(following)
        return self._minima[level]


def _distances(free: NDArray[np.bool_]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return distances from each pixel to the nearest blocked one or the border, (H, W) each.

    Returns:
        From centre to centre; and a lower bound of the distance from any point of the pixel to
        any of the other. Both in pixels.
    """
    padded = np.pad(free, 1).view(np.uint8)
    centres = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    grown = cv2.dilate(1 - padded, np.ones((3, 3), np.uint8))
    gaps = cv2.distanceTransform(1 - grown, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # Two lower bounds from the centre to the nearest point of the square. From anywhere in the
    # pixel it is less by up to half a diagonal.
    lower = np.maximum(centres - _HALF_DIAGONAL, gaps + 0.5) - _HALF_DIAGONAL
    inner = np.s_[1:-1, 1:-1]
    return np.asarray(centres[inner], np.float32), np.asarray(lower[inner], np.float32)


def _quantize(distances: NDArray[np.float32], free: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return the values of a table for lower bounds of the clearance, (H, W)."""
    steps = np.floor(np.clip(distances * (1 / STEP) - 1e-3, UNKNOWN - FREE, 255 - FREE))
    return np.where(free, steps + FREE, UNKNOWN).astype(np.uint8)


def _count_headings(pixels: int, shape: PixelShape) -> int:
    if not shape.turns:
        return 1
    most = max(_FEWEST_HEADINGS, min(_MOST_HEADINGS, _MOST_BYTES // pixels))
    turn = max(_TURN, _TURN_FRACTION * shape.radius)
    return int(min(max(ceil(pi * shape.radius / turn), _FEWEST_HEADINGS), most))


def _covered_pixels(
    part: Points, half: float
) -> tuple[list[tuple[int, int, int]], list[tuple[int, int, int]]]:
    """Return the pixels that a convex part may cover, and those that it covers for certain.

    Args:
        part: (N, 2), at the middle of the range of headings, its reference point at (0, 0).
        half: of the range, radians.

    Returns:
        Offsets from the pixel of the reference point, as runs (row, first column, last column).
    """
    turn = float(np.hypot(*part.T).max()) * half
    low = np.floor(part.min(axis=0) - turn - 1).astype(int)
    high = np.ceil(part.max(axis=0) + turn + 1).astype(int)
    rows, columns = np.mgrid[low[1] : high[1] + 1, low[0] : high[0] + 1]

    edges = np.roll(part, -1, axis=0) - part
    edges = edges[np.hypot(*edges.T) > 0]
    normals = np.stack((edges[:, 1], -edges[:, 0]), axis=1)
    normals /= np.hypot(*normals.T)[:, None]
    touches, certain = np.ones((2, *rows.shape), np.bool_)
    for x, y in (*normals.tolist(), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        beyond = x * columns + y * rows - float((part @ (x, y)).max())
        # The reference point is up to half a pixel from the centre of its pixel along each axis,
        # and a point of the shape from the centre of the pixel that it is in.
        spread = abs(x) + abs(y)
        touches &= beyond <= spread + turn + _ROUNDING
        certain &= beyond <= -(spread / 2 + turn + _ROUNDING)
    return _runs(touches, low), _runs(certain, low)


def _runs(mask: NDArray[np.bool_], low: NDArray[np.intp]) -> list[tuple[int, int, int]]:
    """Return the rows of a convex set of pixels as runs (row, first column, last column)."""
    runs = []
    for row, line in enumerate(mask):
        columns = np.flatnonzero(line)
        if columns.size:
            runs.append((row + int(low[1]), int(columns[0] + low[0]), int(columns[-1] + low[0])))
    return runs
