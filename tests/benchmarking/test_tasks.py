from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from cbagan_ompl import ConfigError, GridMap, Task, TaskError
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, random_tasks, select_tasks
from cbagan_ompl.planning.workspace import Workspace
from cbagan_ompl.robots.robot import Robot


@pytest.fixture
def image(two_walls: GridMap, tmp_path: Path) -> str:
    path = tmp_path / "walls.png"
    cv2.imwrite(str(path), two_walls.free.astype(np.uint8) * 255)
    return str(path)


def test_bundled_maps_and_their_tasks_are_the_default() -> None:
    tasks = select_tasks([])
    assert len(tasks) == 32
    assert tasks[0].name == "bug_trap_0"
    assert [task.name for task in select_tasks(["bundled:maze"], tasks_per_map=2)] == [
        "maze_0",
        "maze_3",
    ]


def test_maps_without_tasks_get_random_ones(image: str) -> None:
    tasks = select_tasks([image], seed=3)
    assert [task.name for task in tasks] == [f"walls_{i}" for i in range(4)]
    assert [t.task for t in select_tasks([image], seed=3)] == [t.task for t in tasks]
    assert [t.task for t in select_tasks([image], seed=4)] != [t.task for t in tasks]
    for task in tasks:
        start, goal = task.grid.check_task(task.task.start, task.task.goal)
        assert np.hypot(*(goal - start)) >= 128
    assert len(select_tasks([image], tasks_per_map=7)) == 7


def test_random_tasks_need_room() -> None:
    free = np.zeros((100, 100), bool)
    free[:3, :3] = True
    with pytest.raises(TaskError, match="found no 2 tasks"):
        random_tasks(Workspace(GridMap(free)), 2, 0)


def test_tasks_are_checked(image: str, tmp_path: Path) -> None:
    tasks = tmp_path / "tasks.csv"
    tasks.write_text("map,start_x,start_y,goal_x,goal_y\nwalls,10,10,20,20\nwalls,10,65,20,20\n")
    with pytest.raises(TaskError, match=r"task 1 of walls: start .* is in an obstacle"):
        select_tasks([image], str(tasks))
    tasks.write_text("map,start_x,start_y,goal_x,goal_y\nwalls,10,10,20,20\n")
    assert select_tasks([image], str(tasks))[0].task == Task((10, 10), (20, 20))
    with pytest.raises(ConfigError, match="two walls_0"):
        select_tasks([image, image], str(tasks))


def test_names_have_no_blanks() -> None:
    grid = GridMap(np.ones((9, 9), bool), name="my map/1")
    assert BenchmarkTask(Workspace(grid), 2, Task((0, 0), (1, 1))).name == "my_map_1_2"


def test_tasks_are_found_for_inflated_maps() -> None:
    tasks = select_tasks(["bundled:maze"], robot=Robot.disc(1.0))
    assert [task.task for task in tasks] == [task.task for task in select_tasks(["bundled:maze"])]
    assert {task.grid.name for task in tasks} == {"maze (inflated by 1)"}
