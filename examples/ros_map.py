"""Plan on a ROS map in metres, for a robot with a radius.

    python examples/ros_map.py

The map is examples/data/office.yaml, which has the form that map savers write. Coordinates are
metres in the frame of the map, y up. It saves a figure as ros_map.png.
"""

from __future__ import annotations

from pathlib import Path

from cbagan_ompl import GridMap, plan
from cbagan_ompl.plotting import save_figure

MAP = Path(__file__).parent / "data" / "office.yaml"

grid = GridMap.load(MAP)
low, high = grid.bounds
print(f"{grid.name}: x from {low[0]:g} to {high[0]:g} m, y from {low[1]:g} to {high[1]:g} m")
# Unknown space is blocked, unless the map is loaded with unknown_is_free=True.
print("middle of the unknown area is free:", bool(grid.is_free((6.5, 0.5))))

result = plan(
    grid,
    (-1.2, 6.2),
    (9.0, 0.0),
    planner="InformedRRTstar",
    radius=0.2,
    time=0.5,
    seed=1,
    keep_tree=True,
)
assert result.solved, result.status
print(f"length: {result.cost:.2f} m")
for x, y in result.path:
    print(f"  {x:6.2f} {y:6.2f}")
save_figure(result, grid, "ros_map.png")
