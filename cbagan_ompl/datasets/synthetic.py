"""Training tasks without end: maps as the world has them, labelled exactly, drawn as they are used.

What a task is depends on the seed and on the number of its map alone.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.validation import check_at_least, check_fraction
from ..map_generators import MAP_GENERATORS, MIN_SIDE, check_generators
from ..map_generators.randomization import randomized_map
from .dataset import Tasks

#: Relative detour at the border of the region, see :func:`detour_heat`.
EPSILON = 0.05
#: Detour in pixels that is added to it, so that the region of a short task is no thread.
SLACK = 1.0

#: Points on each map, every two of which can be a task.
_POINTS = 6
#: Tasks on each map.
TASKS_PER_MAP = 8
#: A task is hard when its shortest way is this many times as long as the straight line.
HARD_DETOUR = 1.3
# Least distance between the ends of a task, as a share of the side.
_MIN_DISTANCE = 0.2


@dataclass(frozen=True)
class SyntheticSettings:
    """What decides the tasks.

    Attributes:
        size: side of the maps in pixels.
        families: names from :data:`cbagan_ompl.map_generators.MAP_GENERATORS`, all equally likely.
        hard_share: share of hard tasks (:data:`HARD_DETOUR`), where the maps have that many.
        seed: of everything.

    Raises:
        ConfigError: an option that makes no sense.
    """

    size: int = 256
    families: tuple[str, ...] = tuple(MAP_GENERATORS)
    hard_share: float = 0.65
    seed: int = 0

    def __post_init__(self) -> None:
        check_at_least("size", self.size, MIN_SIDE)
        check_generators(self.families)
        check_fraction("hard_share", self.hard_share)
        check_at_least("seed", self.seed, 0)

    def description(self) -> dict[str, Any]:
        """What checkpoints and model files say about the data."""
        label = {"epsilon": EPSILON, "slack": SLACK}
        return asdict(self) | {"families": list(self.families), "label": label}


def generate_map_tasks(settings: SyntheticSettings, part: int, number: int) -> Tasks:
    """A map with its tasks.

    Args:
        settings: what kind of tasks.
        part: number of the set: maps of different parts are different maps.
        number: of the map in its part.
    """
    # Compiled on first use, and needed for nothing but this.
    from .geodesic import distances

    rng = np.random.default_rng((settings.seed, part, number))
    while True:
        free = randomized_map(rng, settings.size, settings.families)
        points = _points(free, rng)
        fields = np.stack([distances(free, (u, v)) for u, v in points.tolist()])
        pairs = _chosen_pairs(points, fields, settings, rng)
        if len(pairs) == TASKS_PER_MAP:
            break
    heats = [
        detour_heat(fields[i], fields[j], (int(points[j, 0]), int(points[j, 1]))) for i, j in pairs
    ]
    ends = (points[np.array(pairs)] + 0.5).astype(np.float32)
    return Tasks(
        free[None].astype(np.uint8),
        np.zeros(len(pairs), dtype=np.int64),
        ends[:, 0].copy(),
        ends[:, 1].copy(),
        np.stack(heats).astype(np.float16),
    )


def detour_heat(
    from_start: NDArray[np.float32],
    from_goal: NDArray[np.float32],
    goal: tuple[int, int],
    epsilon: float = EPSILON,
) -> NDArray[np.float32]:
    """The heat map of a task: 1 on a shortest path, 0.5 where a path through takes epsilon more.

    The best path through x is D_s(x) + D_g(x) long, the shortest of all D*. A heat of
    2 ** -((D_s + D_g - D*) / (epsilon D* + SLACK)) makes the values from one half on the informed
    set of the task with walls taken into account: every path that is not more than epsilon longer
    (give or take the slack) stays in it, of every homotopy class.

    Args:
        from_start: distances from the start, (H, W).
        from_goal: distances from the goal, (H, W).
        goal: (column, row) of the goal.
        epsilon: relative detour at the border of the region.
    """
    shortest = float(from_start[goal[1], goal[0]])
    detour = np.maximum(from_start + from_goal - np.float32(shortest), 0)
    heat: NDArray[np.float32] = np.exp2(-detour / np.float32(epsilon * shortest + SLACK))
    return heat


def concatenate_tasks(worlds: list[Tasks]) -> Tasks:
    """The tasks of several maps as one set."""
    return Tasks(
        np.concatenate([world.maps for world in worlds]),
        np.arange(len(worlds)).repeat([len(world) for world in worlds]),
        np.concatenate([world.start for world in worlds]),
        np.concatenate([world.goal for world in worlds]),
        np.concatenate([world.region for world in worlds]),
    )


def _points(free: NDArray[np.bool_], rng: np.random.Generator) -> NDArray[np.intp]:
    """Some free pixels (column, row), (P, 2)."""
    rows, columns = np.nonzero(free)
    chosen = rng.choice(len(rows), size=_POINTS, replace=False)
    return np.stack((columns[chosen], rows[chosen]), axis=-1)


def _chosen_pairs(
    points: NDArray[np.intp],
    fields: NDArray[np.float32],
    settings: SyntheticSettings,
    rng: np.random.Generator,
) -> list[tuple[int, int]]:
    """Start and goal of each task as numbers of points; fewer where the map has too few."""
    straight = np.hypot(*(points[:, None] - points).astype(np.float64).T).T
    shortest = fields[:, points[:, 1], points[:, 0]]
    allowed = straight >= _MIN_DISTANCE * settings.size
    hard = allowed & (shortest >= HARD_DETOUR * straight)
    of_hard, of_others = (
        rng.permutation(np.argwhere(kind)).tolist() for kind in (hard, allowed & ~hard)
    )
    wanted = int(rng.binomial(TASKS_PER_MAP, settings.hard_share))
    ordered = of_hard[:wanted] + of_others + of_hard[wanted:]
    return [(i, j) for i, j in ordered[:TASKS_PER_MAP]]
