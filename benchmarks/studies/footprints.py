"""Is the region right for a robot that turns? Rectangles in SE(2), on generated maps.

    python benchmarks/studies/footprints.py --json benchmarks/results/footprints.json

The network knows of a rectangle only that obstacles are inflated. The truth is computed without it:
the positions through which the rectangle has a path, turning as it has to, that is at most 5 %
and a pixel longer than its shortest (`pose_lattice.py`); the labels of the training are the same
for a point. Rectangles of three aspect ratios and about the same area, on the same tasks, of which
there are three sets. In all of them each rectangle fits at the start and gets from there to the
goal.

* ``random``: goals at random; of twenty the first whose path is 1.3 times as long as the distance,
  or the last one.
* ``gaps``: goals at random among those to which the slender rectangle has to go at least 1.1 times
  as far as a disc of its width: it does not get through a gap, or around a corner, where the disc
  does.
* ``border``: the same for a disc whose centre alone has to be on the map, where one that is all on
  it does not get through either.

Tasks in which a lattice of half pixels has a path of some rectangle that is more than 5 % shorter
are left out: there the truth would be too narrow. The last two sets are chosen against what the
package does, so they say where it fails, not how often.

Heat maps, all with the threshold of the package, and on the map of positions:

* ``as shipped``: ``Predictor.predict(..., robot=robot)``. The network sees the map inflated, with
  its border, by the whole inscribed radius where that connects start and goal, else the map of
  positions.
* ``border free``: the same where the border of the map is no obstacle.
* the network on other maps: that of positions; inflated by the circumscribed radius, or midway
  between both radii, each where it connects, else as shipped; that of the positions which
  the rectangle reaches from the start on the lattice; the raw map, as for a point.
* ``corridor``: ``Heatmap.corridor(..., robot=robot)``; and all positions.

Reported are the intersection over union with the truth, recall and precision, how many regions hold
a path of the rectangle and one within 5 % of its shortest, and how much longer the path in the
region is, where there is one; in brackets bootstrap intervals of 95 % over the tasks, each of which
has a map of its own. ``used`` is the fraction of tasks in which the inflated map connects, and
``difference`` that from ``as shipped``, by pairs.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pose_lattice import PoseLattice, make_lattice, refined_cost
from tqdm import tqdm

from cbagan_ompl import GridMap, Heatmap, MapError, Predictor, Robot, TaskError, load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.geodesic import distance_field
from cbagan_ompl.datasets.geodesic_labels import EPSILON, SLACK
from cbagan_ompl.evaluation.bootstrap import bootstrap_weights, percentile_interval
from cbagan_ompl.map_generators import MAP_GENERATORS
from cbagan_ompl.robots.poses import position_map

#: Length and width in pixels by the aspect ratio, areas of 49 and 50 pixels.
RECTANGLES = {"1:1": (7.0, 7.0), "2:1": (10.0, 5.0), "4:1": (14.0, 3.5)}
SLENDER = "4:1"
# Kinds of maps with walls and passages; those of them in which a slender rectangle has to make a
# detour most often; and open ones, where ways along the border are common.
WALLS = (
    "caves",
    "cell_maze",
    "city",
    "curved_walls",
    "halls",
    "maze",
    "offices",
    "room_grid",
    "rooms",
    "shelves",
    "walls_with_gaps",
    "warehouse",
)
CORNERS = ("caves", "city", "offices", "room_grid", "shelves")
OPEN = ("blocks", "bug_trap", "clutter", "ellipses", "narrow_passage", "tl_shapes", "triangles")
SETS = {"random": (*WALLS, *OPEN), "gaps": CORNERS, "border": OPEN}
SIDE, NEAREST, DETOUR, GOALS = 256, 80.0, 1.3, 20
# How much farther the slender rectangle has to go than a disc in the tasks with gaps.
FARTHER = 1.1
# Training, validation and test use parts 0 to 2.
PART = 12

SHIPPED = "as shipped"
MEASURES = ("iou", "recall", "precision", "held", "within", "used")

Pixel = tuple[int, int]
Cells = NDArray[np.bool_]


@dataclass
class Task:
    """Start and goal, pixels (column, row), with what each rectangle can do on the map."""

    group: str
    grid: GridMap
    start: Pixel
    goal: Pixel
    lattices: dict[str, PoseLattice]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", type=int, default=16, help="of two sets (default: 16)")
    parser.add_argument("--gaps", type=int, default=8, help="of the set gaps (default: 8)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    predictor = load_model()
    robots = {name: Robot.rectangle(*sides) for name, sides in RECTANGLES.items()}
    rows: dict[tuple[str, str], list[dict[str, Any]]] = defaultdict(list)
    seconds: list[float] = []
    maps, left_out = dict.fromkeys(SETS, 0), dict.fromkeys(SETS, 0)
    counts = {group: args.gaps if group == "gaps" else args.tasks for group in SETS}
    tasks = generated_tasks(robots, counts, args.seed, maps, left_out)
    for task in tqdm(tasks, total=sum(counts.values())):
        for name, robot in robots.items():
            began = process_time()
            rows[task.group, name].append(measure(predictor, task, robot, task.lattices[name]))
            seconds.append(process_time() - began)
    result = {
        "seed": args.seed,
        "tasks": counts,
        "maps_generated": maps,
        "left_out": left_out,
        "rectangles": {name: list(sides) for name, sides in RECTANGLES.items()},
        "rows": [row for group in SETS for name in robots for row in summarize(group, name, rows)],
    }
    for row in result["rows"]:
        print({key: value for key, value in row.items() if key != "difference"})
    print(f"{np.mean(seconds):.1f} s of a processor for a rectangle and task")
    if args.json is not None:
        write_json(args.json, result)


def generated_tasks(
    robots: dict[str, Robot],
    counts: dict[str, int],
    seed: int,
    maps: dict[str, int],
    left_out: dict[str, int],
) -> Iterator[Task]:
    """Yield tasks of each set, each on a map of its own.

    How many maps were generated for each set, with a task or without, is counted in ``maps``, and
    in how many a task was left out for the lattice in ``left_out``.
    """
    for part, (group, generators) in enumerate(SETS.items(), PART):
        found = 0
        while found < counts[group]:
            rng = np.random.default_rng((seed, part, maps[group]))
            name = generators[maps[group] % len(generators)]
            maps[group] += 1
            grid = GridMap(MAP_GENERATORS[name](rng, SIDE, SIDE), name=name)
            lattices = {key: make_lattice(grid, robot) for key, robot in robots.items()}
            ends = sample_ends(rng, group, grid, robots[SLENDER], lattices)
            if ends is None:
                continue
            if is_fine_enough(grid, robots, lattices, *ends):
                found += 1
                yield Task(group, grid, *ends, lattices)
            else:
                left_out[group] += 1


def sample_ends(
    rng: np.random.Generator,
    group: str,
    grid: GridMap,
    slender: Robot,
    lattices: dict[str, PoseLattice],
) -> tuple[Pixel, Pixel] | None:
    """Return start and goal of a task; None where the map has none."""
    starts = pixels_of(np.logical_and.reduce([one.positions for one in lattices.values()]))
    if not len(starts):
        return None
    start = to_pixel(starts[rng.integers(len(starts))])
    rows, columns = np.ogrid[: grid.height, : grid.width]
    straight = np.hypot(columns - start[0], rows - start[1])
    costs = lattices[SLENDER].costs_from(start).min(axis=0)
    chosen = np.isfinite(costs) & (straight >= NEAREST)
    if group != "random":
        is_farther = costs >= FARTHER * disc_costs(grid, slender, start, border=True)
        if group == "border":
            is_farther = ~is_farther & (
                costs >= FARTHER * disc_costs(grid, slender, start, border=False)
            )
        chosen &= is_farther
    if not chosen.any():
        return None
    others = [
        one.costs_from(start).min(axis=0) for name, one in lattices.items() if name != SLENDER
    ]
    farthest = np.maximum.reduce([costs, *others])
    goals = pixels_of(chosen & np.isfinite(farthest))
    if not len(goals):
        return None
    drawn = [to_pixel(goals[at]) for at in rng.integers(len(goals), size=GOALS)]
    if group != "random":
        return start, drawn[0]
    long = [goal for goal in drawn if farthest[goal[::-1]] >= DETOUR * straight[goal[::-1]]]
    return start, (long or drawn)[0]


def is_fine_enough(
    grid: GridMap,
    robots: dict[str, Robot],
    lattices: dict[str, PoseLattice],
    start: Pixel,
    goal: Pixel,
) -> bool:
    """Return whether a finer lattice has no path that is more than 5 % shorter."""
    # The slender one first: it is the one for which the lattice matters most.
    return all(
        refined_cost(grid, robots[name], start, goal) * (1 + EPSILON)
        >= lattices[name].cost_between(start, goal)
        for name in reversed(robots)
    )


def disc_costs(grid: GridMap, robot: Robot, start: Pixel, border: bool) -> NDArray[np.float32]:
    """Return how far a disc of the inscribed radius has to go; infinite where it does not fit."""
    try:
        free = grid.inflated(robot.inscribed_radius, border).free
    except MapError:  # nothing is left
        free = np.zeros_like(grid.free)
    if not free[start[::-1]]:
        return np.full(grid.shape, np.inf, np.float32)
    return distance_field(free, start)


def measure(
    predictor: Predictor, task: Task, robot: Robot, lattice: PoseLattice
) -> dict[str, dict[str, float]]:
    """Return the measures of each heat map for a rectangle."""
    from_start, from_goal = lattice.costs_from(task.start), lattice.costs_from(task.goal)
    optimum = float(from_start[:, task.goal[1], task.goal[0]].min())
    true = (from_start + from_goal).min(axis=0) <= (1 + EPSILON) * optimum + SLACK
    reached = np.isfinite(from_start).any(axis=0)
    painted = regions(predictor, task, robot, reached)
    result = {}
    for name, own in painted.items():
        region = painted[SHIPPED] if own is None else own
        both = (region & true).sum()
        inside = region.copy()
        inside[task.start[::-1]] = inside[task.goal[::-1]] = True
        ratio = lattice.cost_between(task.start, task.goal, inside) / optimum
        result[name] = {
            "iou": float(both / (region | true).sum()),
            "recall": float(both / true.sum()),
            "precision": float(both / max(1, region.sum())),
            "held": float(isfinite(ratio)),
            "within": float(ratio <= 1 + EPSILON),
            "used": float(own is not None),
            "ratio": ratio,
        }
    return result


def regions(
    predictor: Predictor, task: Task, robot: Robot, reached: Cells
) -> dict[str, Cells | None]:
    """Return the region of each heat map, on the map of positions; None where it is the shipped."""
    grid = task.grid
    start, goal = (np.array(pixel) + 0.5 for pixel in (task.start, task.goal))
    positions = position_map(grid, robot)
    narrow, wide = robot.inscribed_radius, robot.circumscribed_radius

    def painted(seen: GridMap) -> Cells:
        return predictor.predict(seen, start, goal).region & positions.free

    def inflated(radius: float, border: bool = True) -> Cells | None:
        try:
            return painted(grid.inflated(radius, border))
        except (MapError, TaskError):  # start and goal are not connected any more
            return None

    free_border = inflated(narrow, border=False)
    if free_border is None:  # as position_map does, which gives the diagonal of a pixel back
        free_border = inflated(max(0.0, narrow - 2**0.5), border=False)
    return {
        SHIPPED: predictor.predict(grid, start, goal, robot=robot).region,
        "border free": free_border,
        "map of positions": painted(positions),
        "midway radius": inflated((narrow + wide) / 2),
        "circumscribed radius": inflated(wide),
        "reached positions": painted(GridMap(reached)),
        "raw map": painted(grid),
        "corridor": Heatmap.corridor(grid, start, goal, robot=robot).region,
        "all positions": positions.free,
    }


def summarize(
    group: str, name: str, rows: dict[tuple[str, str], list[dict[str, Any]]]
) -> Iterator[dict[str, Any]]:
    """Yield the means over the tasks of a set, for a rectangle and each heat map."""
    tasks = rows[group, name]
    weights = bootstrap_weights(np.arange(len(tasks)), seed=0)
    for heatmap in tasks[0]:
        values = {key: np.array([task[heatmap][key] for task in tasks]) for key in MEASURES}
        own = {key: np.array([task[SHIPPED][key] for task in tasks]) for key in MEASURES}
        ratios = [task[heatmap]["ratio"] for task in tasks if task[heatmap]["held"]]
        yield {
            "tasks": group,
            "rectangle": name,
            "heatmap": heatmap,
            **{key: mean_of(of, weights) for key, of in values.items()},
            "ratio": np.quantile(ratios, (0.5, 0.9)).tolist() if ratios else None,
            "difference": {key: mean_of(values[key] - own[key], weights) for key in MEASURES},
        }


def mean_of(values: NDArray[np.float64], weights: NDArray[np.float64]) -> list[float]:
    """Return a mean over tasks, and the ends of its interval."""
    means = weights @ values / weights.sum(axis=1)
    return [float(values.mean()), *percentile_interval(means)]


def pixels_of(cells: Cells) -> NDArray[np.intp]:
    """Return the pixels (column, row) of a mask, (N, 2)."""
    return np.argwhere(cells)[:, ::-1]


def to_pixel(values: NDArray[np.intp]) -> Pixel:
    return int(values[0]), int(values[1])


if __name__ == "__main__":
    main()
