"""Hybrid A* of fastsim-navigation on tasks in a file, for ``car_suites.py``.

    python benchmarks/studies/hybrid_astar.py TASKS.npz

Runs in an environment with ``pip install fastsim-navigation`` and needs nothing else. ``TASKS.npz``
holds ``free`` (H, W), ``resolution``, ``origin`` (2,), ``footprint`` (N, 2), ``turning_radius``,
``limit`` in seconds and ``poses`` (K, 2, 3). Prints a JSON list: status, seconds and path of each.
"""

from __future__ import annotations

import json
import sys
from time import process_time

import fastsim_navigation as se2
import numpy as np


def main() -> None:
    with np.load(sys.argv[1]) as file:
        tasks = {name: file[name] for name in file.files}
    # Row 0 of its map is at the bottom.
    cells = np.where(tasks["free"][::-1], 0, 254).astype(np.uint8)
    x, y = map(float, tasks["origin"])
    costmap = se2.Costmap(np.ascontiguousarray(cells), float(tasks["resolution"]), x, y)
    config = se2.PlannerConfig()
    config.minimum_turning_radius = float(tasks["turning_radius"])
    config.allow_reverse = True
    config.max_planning_time_seconds = float(tasks["limit"])
    outline = [se2.Point2D(*map(float, point)) for point in tasks["footprint"]]
    results = []
    for start, goal in tasks["poses"].tolist():
        request = se2.PlanRequest()
        request.start, request.goal = se2.Pose2D(*start), se2.Pose2D(*goal)
        request.footprint = se2.PolygonFootprint(outline)
        began = process_time()
        result = se2.HybridAStar(costmap).plan(request, config)
        seconds = process_time() - began
        status = se2.planner_status_name(result.status)
        path = result.path_array.tolist()
        results.append({"status": status, "seconds": seconds, "path": path})
    print(json.dumps(results))


if __name__ == "__main__":
    main()
