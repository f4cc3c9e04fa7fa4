"""The speed of a prediction, by the size of the map and by what computes the network.

    OMP_NUM_THREADS=1 python scripts/inference_speed.py --json inference_speed.json

The models take turns on the same tasks, on random maps of each size. ``first`` is a prediction on a
map that is new, with the labels of its parts and its scaled copy; ``next`` one for another task on
it; ``of 64`` a task of 64 in one call; all with repair. ``attach`` is that of the next heat map to
RRT*. Times are those of the processor (one thread, so that other work does not count), medians over
the tasks, in milliseconds. ``memory`` is how much more of it the process has at the most while the
first prediction is made, in MB, the largest over the maps.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from search_speed import GENERATORS

from cbagan_ompl import GridMap, Heatmap, Predictor, attach, load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.common.markdown import table
from cbagan_ompl.inference.bundled_models import bundled_model
from cbagan_ompl.map_generators import MAP_GENERATORS
from cbagan_ompl.planning.compat import og
from cbagan_ompl.planning.problem import make_setup
from cbagan_ompl.planning.workspace import Workspace

TIMES = ("first", "next", "of 64", "attach")
COLUMNS = (*TIMES, "memory")
BATCH = 64
LARGEST = 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[256, 512, 1024, 2048, 4096])
    parser.add_argument("--model", action="append", metavar="FILE", help="may be repeated")
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON")
    args = parser.parse_args()
    default = bundled_model().with_suffix(".pt")
    paths = args.model or [default, default.with_suffix(".onnx")]
    models = {str(path).rpartition("/")[2]: load_model(path) for path in paths}
    result: dict[str, Any] = {"sizes": {str(size): measure(models, size) for size in args.sizes}}
    print(speed_table(result))
    if args.json is not None:
        write_json(args.json, result)


def measure(models: Mapping[str, Predictor], size: int) -> dict[str, dict[str, float]]:
    """Return the medians of all models on maps of a size."""
    times: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    memory: dict[str, float] = defaultdict(float)
    for free, tasks in random_tasks(size):
        starts, goals = tasks[:, 0], tasks[:, 1]
        for name, model in models.items():
            grid = GridMap(free)
            before = forget_peak()
            times[name]["first"].append(seconds(model.predict, grid, starts[0], goals[0]))
            memory[name] = max(memory[name], status("VmHWM") - before)
            for start, goal in tasks[1:6]:
                begin = process_time()
                heatmap = model.predict(grid, start, goal)
                times[name]["next"].append(process_time() - begin)
                times[name]["attach"].append(attach_seconds(heatmap, start, goal))
            if size == min(model.record["working_size"], size):
                duration = seconds(model.predict_many, grid, starts, goals)
                times[name]["of 64"].append(duration / BATCH)
    return {
        name: {column: 1e3 * float(np.median(values)) for column, values in rows.items()}
        | {"memory": memory[name]}
        for name, rows in times.items()
    }


def attach_seconds(
    heatmap: Heatmap, start: NDArray[np.float64], goal: NDArray[np.float64]
) -> float:
    """Return how long it takes to attach a heat map to RRT*."""
    setup = make_setup(Workspace(heatmap.grid), np.stack((start, goal)), 1.0)
    setup.setPlanner(og.RRTstar(setup.getSpaceInformation()))
    begin = process_time()
    with attach(setup, heatmap, seed=0):
        return process_time() - begin


def forget_peak() -> float:
    """Forget the most memory that the process has had; return what it has now, MB."""
    Path("/proc/self/clear_refs").write_text("5")
    return status("VmRSS")


def status(name: str) -> float:
    """Return an entry of the process's status as Linux tells it, MB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    entry = next(line for line in lines if line.startswith(f"{name}:"))
    return int(entry.split()[1]) / 1024


def random_tasks(size: int) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.float64]]]:
    """Yield maps, and for each the tasks, (64, 2, 2), a third of the side apart at least.

    Maps of more than 1024 pixels, which take minutes to generate, are enlarged ones.
    """
    for seed, name in enumerate(GENERATORS):
        rng = np.random.default_rng(seed)
        side = min(size, LARGEST)
        free = MAP_GENERATORS[name](rng, side, side).repeat(size // side, 0).repeat(size // side, 1)
        pixels = np.argwhere(free)[:, ::-1] + 0.5
        pairs = rng.choice(pixels, (8 * BATCH, 2))
        far = np.hypot(*(pairs[:, 1] - pairs[:, 0]).T) > size / 3
        yield free, pairs[far][:BATCH]


def seconds(function: Callable[..., object], *arguments: Any) -> float:
    begin = process_time()
    function(*arguments)
    return process_time() - begin


def speed_table(result: Mapping[str, Any]) -> str:
    """Return the figures as a table of Markdown."""
    rows = [
        (
            f"{size} px",
            name,
            *(f"{row[column]:.2f}" if column in row else "" for column in TIMES),
            f"{row['memory']:.0f} MB",
        )
        for size, models in result["sizes"].items()
        for name, row in models.items()
    ]
    return table(("map", "model", *COLUMNS), rows)


if __name__ == "__main__":
    main()
