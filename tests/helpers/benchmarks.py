"""A small benchmark, run by the command line on one map."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from cbagan_ompl.benchmarking.logs import ExperimentLog, parse_log

TASKS = "map,start_x,start_y,goal_x,goal_y,optimal_cost\nwalls,10,10,90,90,\nwalls,90,5,10,95,1\n"


@dataclass(frozen=True)
class Finished:
    arguments: list[str]
    folder: Path
    printed: str

    @property
    def logs(self) -> list[ExperimentLog]:
        return [parse_log(path.read_text()) for path in sorted(self.folder.glob("logs/*.log"))]


def write_map(folder: Path) -> None:
    """Write the map ``walls.png`` and its two tasks, ``tasks.csv``."""
    free = np.full((100, 100), 255, np.uint8)
    free[40:44, :75] = 0
    free[62:66, 25:] = 0
    cv2.imwrite(str(folder / "walls.png"), free)
    (folder / "tasks.csv").write_text(TASKS)


def run_benchmark_of_walls(map_folder: Path, folder: Path) -> Finished:
    """Run the benchmark; the corridor needs no torch."""
    arguments = ["benchmark", str(map_folder / "walls.png"), "--range", "10", "--time", "0.1"]
    arguments += ["--tasks", str(map_folder / "tasks.csv"), "--planners", "RRT,RRTstar"]
    arguments += ["--samplers", "uniform,corridor", "--runs", "3", "--set", "RRTstar.goal_bias=0.1"]
    arguments += ["--jobs", "2", "--output", str(folder)]
    done = subprocess.run(
        [sys.executable, "-m", "cbagan_ompl.cli", *arguments], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "leaked" not in done.stderr
    return Finished(arguments, folder, done.stdout)
