"""Train a model on maps of your own, export it, and plan with it: a tiny run of some seconds.

    python examples/train_on_own_maps.py

It shows the steps, not a good model, which takes thousands of tasks. The "own maps" are pieces of
the office of the examples, 64 x 64 pixels each. The label of a task is the region that the network
is to learn: here a band around the shortest path. The data set has the layout of the data set that
the CBAGAN-RRT paper uses, so the command line takes it:

    cbagan-ompl train mine --output runs/mine
    cbagan-ompl export runs/mine/best.pt --output mine.pt
    cbagan-ompl plan examples/data/office.yaml --start -1.2,6.2 --goal 9,0 --model mine.pt

To let the package label maps for you instead, see `cbagan-ompl dataset generate --help`.
"""

from __future__ import annotations

import csv
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from cbagan_ompl import GridMap, Heatmap, TaskError, plan
from cbagan_ompl.cli import main as cbagan_ompl

MAP = Path(__file__).parent / "data" / "office.pgm"
SIDE, TASKS_PER_MAP = 64, 16
BLUE, RED, GREEN = (255, 0, 0), (0, 0, 255), (0, 255, 0)  # as OpenCV has them

Pixel = tuple[float, float]


def own_maps() -> list[GridMap]:
    office = GridMap.load(MAP)
    corners = [(row, column) for row in (0, 48, 96) for column in (0, 56, 112, 168)]
    return [GridMap(office.free[r : r + SIDE, c : c + SIDE]) for r, c in corners]


def label(grid: GridMap, rng: np.random.Generator) -> tuple[Pixel, Pixel, np.ndarray]:
    """Return a random task of a map and its region; start and goal are connected."""
    while True:
        points = np.floor(rng.uniform(0, SIDE, (2, 2))) + 0.5
        try:
            region = Heatmap.corridor(grid, *points).region
        except TaskError:  # in an obstacle, or with no path between them
            continue
        start, goal = (tuple(point) for point in points.tolist())
        return start, goal, region


def write_data_set(root: Path, maps: list[GridMap]) -> None:
    """Write maps/map_K.png, tasks/map_K/task_N.png, task_N_roi.png, train.csv and test.csv."""
    rng = np.random.default_rng(0)
    rows = []
    (root / "maps").mkdir(parents=True)
    for k, grid in enumerate(maps):
        cv2.imwrite(str(root / "maps" / f"map_{k}.png"), grid.free.astype(np.uint8) * 255)
        folder = root / "tasks" / f"map_{k}"
        folder.mkdir(parents=True)
        for n in range(TASKS_PER_MAP):
            start, goal, region = label(grid, rng)
            spots = np.full((SIDE, SIDE, 3), 255, np.uint8)
            for (x, y), color in ((start, BLUE), (goal, RED)):
                spots[int(y), int(x)] = color
            painted = np.full((SIDE, SIDE, 3), 255, np.uint8)
            painted[region] = GREEN
            cv2.imwrite(str(folder / f"task_{n}.png"), spots)
            cv2.imwrite(str(folder / f"task_{n}_roi.png"), painted)
            rows.append((f"map_{k}.png", f"task_{n}.png", f"task_{n}_roi.png"))
    # Whole maps are held out for the test.
    held_out = 2 * TASKS_PER_MAP
    for name, part in (("train", rows[:-held_out]), ("test", rows[-held_out:])):
        with (root / f"{name}.csv").open("w", newline="") as file:
            csv.writer(file).writerows([("map", "task", "roi"), *part])


def run(*arguments: str | Path) -> None:
    words = [str(argument) for argument in arguments]
    print("\n$ cbagan-ompl", *words)
    status = cbagan_ompl(words)
    if status != 0:
        raise SystemExit(status)


def main() -> None:
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_data_set(folder / "mine", own_maps())
        options = ("--epochs", "6", "--set", "batch_size=8", "ema_decay=0.9", "--threads", "1")
        run("train", folder / "mine", "--output", folder / "runs", *options)
        run("export", folder / "runs" / "best.pt", "--output", folder / "mine.pt")
        run("evaluate", "--dataset", folder / "mine", "--model", folder / "mine.pt")
        result = plan(MAP, (16.5, 16.5), (220.5, 140.5), model=folder / "mine.pt", time=0.5, seed=1)
        print("\nplanned with it:", "solved" if result.solved else "not solved")


if __name__ == "__main__":
    main()
