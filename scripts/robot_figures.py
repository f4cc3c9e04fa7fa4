"""The figures of robots: OMPL's own sampler and the heat map's poses, after the same time.

python scripts/robot_figures.py --folder docs/images
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cbagan_ompl import GridMap, PlanResult, Robot, load_model, plan, tasks_of
from cbagan_ompl.plotting import draw_plan

#: Arrows that show how poses are sampled.
SAMPLES = 160


@dataclass(frozen=True)
class Scene:
    """A robot on a bundled map, and how it is planned for."""

    name: str
    map_name: str
    task: int
    robot: Robot
    seconds: float
    arrow: float


SCENES = (
    Scene(
        "car-parking", "parking", 0, Robot.rectangle(8, 4, turning_radius=6, reverse=True), 0.5, 6
    ),
    Scene("long-robot", "warehouse", 3, Robot.rectangle(20, 5), 1.0, 8),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", required=True)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    model = load_model()
    for scene in SCENES:
        grid = GridMap.load(f"bundled:{scene.map_name}")
        task = tasks_of(f"bundled:{scene.map_name}", grid, with_yaw=True)[scene.task]
        options = {"robot": scene.robot, "range": 30.0, "keep_tree": True, "seed": args.seed}
        figure = Figure(figsize=(10.0, 3.5), layout="constrained")
        for axes, sampler in zip(figure.subplots(1, 2), ("uniform", "learned"), strict=True):
            made = {"model": model} if sampler == "learned" else {}
            for _ in range(2):  # the first call in a process takes longer
                before = plan(
                    grid, task.start, task.goal, "RRT", sampler, time=0.1, **made, **options
                )
            # The time of the heat map is the planner's loss.
            seconds = scene.seconds - before.inference_s
            result = plan(
                grid, task.start, task.goal, "RRTstar", sampler, time=seconds, **made, **options
            )
            draw_samples(axes, result, grid, scene.arrow)
            draw_plan(axes, result, grid)
            axes.set_title(headline(result, scene.seconds), fontsize=9)
        path = Path(args.folder) / f"{scene.name}.png"
        figure.savefig(path, dpi=110)
        print(path, [text.get_title() for text in figure.axes])


def draw_samples(axes: Axes, result: PlanResult, grid: GridMap, length: float) -> None:
    """Draw what poses are sampled: those of the heat map, or uniform ones."""
    rng = np.random.default_rng(0)
    if result.heatmap is None:
        poses = rng.uniform((*grid.bounds[0], -pi), (*grid.bounds[1], pi), (SAMPLES, 3))
    else:
        poses = result.heatmap.sample_poses(SAMPLES, rng, reverses=result.robot.reverse)
    x, y, yaw = poses.T
    axes.quiver(
        x, y, length * np.cos(yaw), length * np.sin(yaw), angles="xy", scale_units="xy", scale=1,
        color="0.45", width=0.0018, zorder=1.5,
    )  # fmt: skip


def headline(result: PlanResult, seconds: float) -> str:
    sampler = "OMPL's own sampler" if result.heatmap is None else "poses of the heat map"
    if not result.solved:
        return f"{sampler}: no path in {seconds:g} s"
    first = 1e3 * (result.inference_s + result.first_solution_s)
    return f"{sampler}: first path after {first:.0f} ms, cost {result.cost:.0f} after {seconds:g} s"


if __name__ == "__main__":
    main()
