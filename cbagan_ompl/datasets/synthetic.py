"""Synthetic tasks without end: random maps with exact labels, generated while they are used.

A map and its tasks depend on the seed, the part and the number of the map alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.validation import check_at_least, check_fraction
from ..map_generators import MAP_GENERATORS, MIN_SIZE, check_generators
from ..map_generators.randomization import randomized_map
from ..map_generators.shapes import inflate
from .dataset import Tasks
from .geodesic_labels import EPSILON, SLACK, geodesic_label, travel_directions

#: Tasks on each map.
TASKS_PER_MAP = 8
#: A task is hard when its shortest path is at least this many times as long as the straight line.
HARD_DETOUR = 1.3

# Points on each map; any two of them can be start and goal of a task.
_POINTS = 6
# Least fraction of an inflated map that is free.
_LEAST_FREE = 0.08
# Least distance from start to goal, as a fraction of the map's size.
_MIN_DISTANCE = 0.2


@dataclass(frozen=True)
class SyntheticSettings:
    """Settings of synthetic tasks.

    Attributes:
        size: width and height of the maps in pixels.
        generators: keys of :data:`cbagan_ompl.map_generators.MAP_GENERATORS`, all equally likely.
        hard_fraction: fraction of hard tasks (see :data:`HARD_DETOUR`), where a map has that many.
        inflated_fraction: fraction of the maps whose obstacles are inflated by a radius of 1 pixel
            to a 32nd of the size, as for a robot.
        seed: of all random numbers.

    Raises:
        ConfigError: a setting out of range, or an unknown generator.

    Example:
        >>> SyntheticSettings(size=64, generators=("maze",)).hard_fraction
        0.65
    """

    size: int = 256
    generators: tuple[str, ...] = tuple(MAP_GENERATORS)
    hard_fraction: float = 0.65
    inflated_fraction: float = 0.2
    seed: int = 0

    def __post_init__(self) -> None:
        check_at_least("size", self.size, MIN_SIZE)
        check_generators(self.generators)
        check_fraction("hard_fraction", self.hard_fraction)
        check_fraction("inflated_fraction", self.inflated_fraction)
        check_at_least("seed", self.seed, 0)

    def description(self) -> dict[str, Any]:
        """Return the settings as checkpoints and model files record them."""
        label = {"epsilon": EPSILON, "slack": SLACK}
        return asdict(self) | {"generators": list(self.generators), "label": label}


def generate_map_tasks(settings: SyntheticSettings, part: int, number: int) -> Tasks:
    """Generate one map and its :data:`TASKS_PER_MAP` tasks.

    Args:
        settings: of the tasks.
        part: number of the part, such as training or validation: maps of different parts differ.
        number: of the map in its part.
    """
    # Here, since numba takes long to import.
    from .geodesic import distance_field

    rng = np.random.default_rng((settings.seed, part, number))
    while True:
        free = randomized_map(rng, settings.size, settings.generators)
        if rng.random() < settings.inflated_fraction:
            free = inflate(free, float(rng.uniform(1, settings.size / 32)))
            if free.mean() < _LEAST_FREE:
                continue
        points = _sample_points(free, rng)
        fields = np.stack([distance_field(free, (u, v)) for u, v in points.tolist()])
        pairs = _choose_pairs(points, fields, settings, rng)
        if len(pairs) == TASKS_PER_MAP:
            break
    labels = [
        geodesic_label(fields[i], fields[j], (int(points[j, 0]), int(points[j, 1])))
        for i, j in pairs
    ]
    directions = [
        travel_directions(fields[j], label) for (_, j), label in zip(pairs, labels, strict=True)
    ]
    endpoints = (points[np.array(pairs)] + 0.5).astype(np.float32)
    return Tasks(
        free[None].astype(np.uint8),
        np.zeros(len(pairs), dtype=np.int64),
        endpoints[:, 0].copy(),
        endpoints[:, 1].copy(),
        np.stack(labels).astype(np.float16),
        np.stack(directions).astype(np.float16),
    )


def concatenate_tasks(map_tasks: Sequence[Tasks]) -> Tasks:
    """Return the tasks of several maps, each with one map, as one set."""
    return Tasks(
        np.concatenate([tasks.maps for tasks in map_tasks]),
        np.arange(len(map_tasks)).repeat([len(tasks) for tasks in map_tasks]),
        np.concatenate([tasks.start for tasks in map_tasks]),
        np.concatenate([tasks.goal for tasks in map_tasks]),
        np.concatenate([tasks.region for tasks in map_tasks]),
        np.concatenate([tasks.direction for tasks in map_tasks if tasks.direction is not None]),
    )


def _sample_points(free: NDArray[np.bool_], rng: np.random.Generator) -> NDArray[np.intp]:
    """Sample different free pixels (column, row), shape (P, 2)."""
    rows, columns = np.nonzero(free)
    chosen = rng.choice(len(rows), size=_POINTS, replace=False)
    return np.stack((columns[chosen], rows[chosen]), axis=-1)


def _choose_pairs(
    points: NDArray[np.intp],
    fields: NDArray[np.float32],
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> list[tuple[int, int]]:
    """Choose start and goal of each task.

    Args:
        points: (P, 2), columns and rows of the points.
        fields: (P, H, W), the distance field of each point.
        settings: of the tasks.
        rng: source of all random numbers.

    Returns:
        Indices of the points; fewer than :data:`TASKS_PER_MAP` where the map has too few pairs
        that are far enough apart.
    """
    straight = np.hypot(*(points[:, None] - points).astype(np.float64).T).T
    shortest = fields[:, points[:, 1], points[:, 0]]
    allowed = straight >= _MIN_DISTANCE * settings.size
    is_hard = allowed & (shortest >= HARD_DETOUR * straight)
    hard, easy = (
        rng.permutation(np.argwhere(kind)).tolist() for kind in (is_hard, allowed & ~is_hard)
    )
    hard_count = int(rng.binomial(TASKS_PER_MAP, settings.hard_fraction))
    ordered = hard[:hard_count] + easy + hard[hard_count:]
    return [(i, j) for i, j in ordered[:TASKS_PER_MAP]]
