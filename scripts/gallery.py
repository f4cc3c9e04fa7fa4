"""The figure of the README: heat maps of the bundled model on bundled maps, paths of RRT*.

python scripts/gallery.py --output docs/images/regions.png
"""

from __future__ import annotations

import argparse

from matplotlib.figure import Figure

from cbagan_ompl import GridMap, load_model, plan, tasks_of
from cbagan_ompl.plotting import draw_plan

#: The maps, and the number of the task that is shown on each.
SHOWN = {"rooms": 0, "maze": 1, "warehouse": 1, "bug_trap": 0, "narrow_passage": 1, "clutter": 0}
COLUMNS = 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", metavar="FILE")
    parser.add_argument("--output", required=True, metavar="FILE")
    args = parser.parse_args()
    predictor = load_model(args.model)
    figure = Figure(figsize=(9.0, 6.1), layout="constrained")
    panels = figure.subplots(len(SHOWN) // COLUMNS, COLUMNS, squeeze=False)
    for axes, (name, number) in zip(panels.flat, SHOWN.items(), strict=True):
        grid = GridMap.load(f"bundled:{name}")
        task = tasks_of(f"bundled:{name}", grid)[number]
        # First, because the first call of a size takes longer.
        raw = predictor.predict(grid, task.start, task.goal, repair=False)
        result = plan(grid, task.start, task.goal, model=predictor, time=1, range=20, seed=0)
        draw_plan(axes, result, grid)
        state = "connected" if raw.connects(task.start, task.goal) else "repaired"
        axes.set_title(f"{name}: {state}, {1e3 * result.inference_s:.0f} ms", fontsize=9)
    figure.savefig(args.output, dpi=110)


if __name__ == "__main__":
    main()
