"""Draw the bundled maps, cbagan_ompl/maps/bundled/*.png, and write their tasks.

``tasks.csv`` has positions for robots without heading, ``car_tasks.csv`` poses for a car. Run it
from anywhere, ``python scripts/make_bundled_maps.py``; it always writes the same maps and tasks.
"""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Iterator
from math import atan2, pi
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from cbagan_ompl import GridMap, Robot
from cbagan_ompl.map_generators import MAP_GENERATORS
from cbagan_ompl.maps.grid_search import pull_taut, shortest_path
from cbagan_ompl.robots.poses import snap_poses
from cbagan_ompl.robots.shape_checker import ShapeChecker

FOLDER = Path(__file__).resolve().parents[1] / "cbagan_ompl" / "maps" / "bundled"
SEED = 4
SIZES = {"warehouse": (320, 192)}

# What the poses are for: it fits through all passages on the way of every task.
CAR = Robot.rectangle(8, 4, turning_radius=6, reverse=True)

# The headings at both ends of a task are those towards the path so far away, in pixels.
_AHEAD = 15.0

# The parking lot, in pixels: slots across and along, the lane between two rows of slots, the wall
# around it, and the share of the slots that are taken.
SLOT, LANE, WALL, TAKEN = (6, 11), 15, 3, 0.8
ROWS, COLUMNS = 8, 41

# Start and goal pixels, chosen by eye; in the parking lot free slots. The first of a map is the
# most instructive one.
TASKS = {
    # Out of the trap to what lies behind it; into it; past it; out of it, to the mouth's own side.
    "bug_trap": [
        (172, 125, 226, 122),
        (238, 185, 160, 165),
        (12, 125, 240, 55),
        (150, 90, 14, 236),
    ],
    "clutter": [(16, 12, 246, 246), (10, 138, 206, 22), (246, 152, 10, 216), (64, 246, 246, 60)],
    # Between cells in opposite corners, then between the middles of opposite borders.
    "maze": [(10, 10, 245, 245), (245, 10, 10, 245), (10, 118, 245, 136), (118, 10, 136, 245)],
    # The second is a few pixels through the wall, and a long way round.
    "narrow_passage": [
        (30, 62, 222, 112),
        (104, 20, 164, 24),
        (20, 240, 240, 30),
        (184, 240, 60, 130),
    ],
    # Into a slot, from slot to slot across the lot, out of one, and into the one behind.
    "parking": [(12, 132, 144, 8), (42, 8, 192, 145), (96, 34, 240, 95), (108, 45, 162, 71)],
    "rooms": [(14, 14, 242, 242), (242, 14, 14, 242), (14, 118, 244, 160), (62, 216, 206, 62)],
    "walls_with_gaps": [
        (14, 20, 240, 240),
        (14, 240, 240, 14),
        (14, 150, 240, 60),
        (65, 20, 196, 246),
    ],
    # From the loading zone to the far corner; the rest begin or end between racks.
    "warehouse": [(14, 172, 306, 14), (14, 70, 270, 160), (100, 26, 280, 121), (204, 178, 70, 45)],
}


def slots() -> Iterator[tuple[float, float, float]]:
    """Yield the pose of a car in each slot of the parking lot, its front towards the lane."""
    top = WALL
    for row in range(ROWS):
        # A lane lies below each even row, and one to the left and to the right of inner rows.
        first, last = (0, COLUMNS) if row in (0, ROWS - 1) else (3, COLUMNS - 3)
        for column in range(first, last):
            x = WALL + SLOT[0] * (column + 0.5)
            yield x, top + SLOT[1] / 2, pi / 2 if row % 2 == 0 else -pi / 2
        top += SLOT[1] + (LANE if row % 2 == 0 else 0)


def draw_parking() -> NDArray[np.bool_]:
    """Return the parking lot, with a car in most of the slots."""
    rng = np.random.default_rng([SEED, *b"parking"])
    height = 2 * WALL + ROWS * SLOT[1] + ROWS // 2 * LANE
    free = np.zeros((height, 2 * WALL + COLUMNS * SLOT[0]), bool)
    free[WALL:-WALL, WALL:-WALL] = True
    for x, y, _ in slots():
        if rng.random() < TAKEN:
            left, upper = int(x - 2 + rng.integers(-1, 2)), int(y - 4 + rng.integers(-1, 2))
            free[upper : upper + 8, left : left + 4] = False
    return free


def draw(name: str) -> NDArray[np.bool_]:
    """Return a bundled map."""
    if name == "parking":
        return draw_parking()
    rng = np.random.default_rng([SEED, *name.encode("ascii")])
    return MAP_GENERATORS[name](rng, *SIZES.get(name, (256, 256)))


def tasks_csv() -> str:
    """Return the content of tasks.csv: the centres of the chosen pixels."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("map", "start_x", "start_y", "goal_x", "goal_y"))
    for name, tasks in sorted(TASKS.items()):
        writer.writerows((name, *(pixel + 0.5 for pixel in task)) for task in tasks)
    return text.getvalue()


def car_tasks_csv() -> str:
    """Return the content of car_tasks.csv: the same tasks for a car, with headings."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("map", "start_x", "start_y", "start_yaw", "goal_x", "goal_y", "goal_yaw"))
    for name, tasks in sorted(TASKS.items()):
        checker = ShapeChecker.of(GridMap(draw(name)), CAR)
        for task in tasks:
            start, goal = parking_poses(task) if name == "parking" else driven_poses(checker, task)
            poses, _ = snap_poses(checker, start, goal, distance=20.0)
            writer.writerow((name, *(round(value, 3) for pose in poses for value in pose.tolist())))
    return text.getvalue()


def parking_poses(task: tuple[int, int, int, int]) -> list[tuple[float, float, float]]:
    """Return the poses in two slots, or to the right in a lane."""
    in_slots = {(int(x), int(y)): (x, y, yaw) for x, y, yaw in slots()}
    return [in_slots.get(place, (*place, 0.0)) for place in (task[:2], task[2:])]


def driven_poses(
    checker: ShapeChecker, task: tuple[int, int, int, int]
) -> list[tuple[float, float, float]]:
    """Return the poses at both ends of the shortest path of a point, along it."""
    free = checker.grid.free
    pixels = shortest_path(free, task[:2], task[2:])
    assert pixels is not None
    path = pull_taut(free, pixels)
    along = np.concatenate(([0.0], np.hypot(*np.diff(path, axis=0).T).cumsum()))
    ahead, behind = (
        [float(np.interp(place, along, axis)) for axis in path.T]
        for place in (_AHEAD, along[-1] - _AHEAD)
    )
    (x0, y0), (x1, y1) = path[0].tolist(), path[-1].tolist()
    leaving = atan2(ahead[1] - y0, ahead[0] - x0)
    arriving = atan2(y1 - behind[1], x1 - behind[0])
    return [(x0, y0, leaving), (x1, y1, arriving)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.parse_args()
    FOLDER.mkdir(exist_ok=True)
    for name in TASKS:
        # One bit a pixel: the whole set is a few kilobytes.
        image = draw(name).astype(np.uint8) * 255
        cv2.imwrite(str(FOLDER / f"{name}.png"), image, [cv2.IMWRITE_PNG_BILEVEL, 1])
    (FOLDER / "tasks.csv").write_text(tasks_csv(), encoding="utf-8")
    (FOLDER / "car_tasks.csv").write_text(car_tasks_csv(), encoding="utf-8")
    print(f"{len(TASKS)} maps and their tasks written to {FOLDER}")


if __name__ == "__main__":
    main()
