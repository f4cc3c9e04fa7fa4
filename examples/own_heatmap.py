"""Sample from a heat map of your own: any array of the map's shape with values from 0 to 1.

    python examples/own_heatmap.py

Neither torch nor a model is needed. Here the heat map prefers pixels far from obstacles, and
leaves out a room. Other sources: the output of another network, where the robot drove before, a
drawing of a person.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from cbagan_ompl import GridMap, Heatmap, SamplerOptions, plan

MAP = Path(__file__).parent / "data" / "office.yaml"
START, GOAL = (-0.5, 4.2), (9.0, 0.0)

grid = GridMap.load(MAP)
# Rows count from the top of the map, columns from the left, as in Heatmap.values.
clearance = cv2.distanceTransform(grid.free.astype(np.uint8), cv2.DIST_L2, 5)
values = np.clip(clearance / 16, 0, 1)
values[:66, 78:150] = 0  # the middle room of the upper row

heatmap = Heatmap(values, grid)
print(heatmap)
print("connects start and goal:", heatmap.connects(START, GOAL))

# A fifth of the samples stays uniform over free space, for what the heat map got wrong.
options = SamplerOptions(uniform_fraction=0.2, seed=1)
result = plan(grid, START, GOAL, heatmap=heatmap, time=0.5, options=options)
assert result.solved, result.status
print(f"length: {result.cost:.2f} m, samples: {result.sample_counts}")

# Heatmap.sample gives the points themselves, for planners other than OMPL's.
points = heatmap.sample(5, np.random.default_rng(1))
print("samples at", np.round(points, 2).tolist())
