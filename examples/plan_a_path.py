"""Plan a path on a bundled map, and look at what came out.

    python examples/plan_a_path.py

It saves a figure of the map, the heat map, the planner's tree and the path as plan_a_path.png.
"""

from __future__ import annotations

from cbagan_ompl import GridMap, plan, tasks_of
from cbagan_ompl.plotting import save_figure

grid = GridMap.load("bundled:rooms")
task = tasks_of("bundled:rooms", grid)[0]

for sampler in ("uniform", "learned"):
    result = plan(
        grid,
        task.start,
        task.goal,
        planner="RRTstar",
        sampler=sampler,
        time=0.5,
        range=20,
        seed=1,
        keep_tree=True,
    )
    if not result.solved:
        print(f"{sampler:8}: no path within {result.planning_s:.1f} s")
        continue
    print(
        f"{sampler:8}: length {result.cost:.1f} pixels, first path after "
        f"{1e3 * (result.inference_s + result.first_solution_s):.1f} ms of inference and planning"
    )

# The result of the last run: samples by where they came from, and the way points.
print("samples:", result.sample_counts)
print("way points:", len(result.path))
save_figure(result, grid, "plan_a_path.png")
