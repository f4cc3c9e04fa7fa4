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
    tasks = select_tasks([]).tasks
    assert len(tasks) == 32
    assert tasks[0].name == "bug_trap_0"
    assert [task.name for task in select_tasks(["bundled:maze"], tasks_per_map=2).tasks] == [
        "maze_0",
        "maze_3",
    ]


def test_maps_without_tasks_get_random_ones(image: str) -> None:
    tasks = select_tasks([image], seed=3).tasks
    assert [task.name for task in tasks] == [f"walls_{i}" for i in range(4)]
    assert [t.task for t in select_tasks([image], seed=3).tasks] == [t.task for t in tasks]
    assert [t.task for t in select_tasks([image], seed=4).tasks] != [t.task for t in tasks]
    for task in tasks:
        start, goal = task.grid.check_task(task.task.start, task.task.goal)
        assert np.hypot(*(goal - start)) >= 128
    assert len(select_tasks([image], tasks_per_map=7).tasks) == 7


def test_random_tasks_need_room() -> None:
    free = np.zeros((100, 100), bool)
    free[:3, :3] = True
    with pytest.raises(TaskError, match="found no 2 tasks"):
        random_tasks(Workspace(GridMap(free)), 2, 0)


def test_tasks_are_checked(image: str, tmp_path: Path) -> None:
    tasks = tmp_path / "tasks.csv"
    tasks.write_text("map,start_x,start_y,goal_x,goal_y\nwalls,10,10,20,20\nwalls,10,65,20,20\n")
    selection = select_tasks([image], str(tasks))
    assert [task.task for task in selection.tasks] == [Task((10, 10), (20, 20))]
    assert list(selection.left_out) == ["walls_1"]
    assert "is in an obstacle" in selection.left_out["walls_1"]
    with pytest.raises(ConfigError, match=r"two walls_0 .*NAME=FILE"):
        select_tasks([image, image], str(tasks))
    tasks.write_text("map,start_x,start_y,goal_x,goal_y\nwalls,10,65,20,20\n")
    with pytest.raises(TaskError, match=r"none of 1 tasks .*walls_0: start .* is in an obstacle"):
        select_tasks([image], str(tasks))


def test_names_have_no_blanks() -> None:
    grid = GridMap(np.ones((9, 9), bool), name="my map/1")
    assert BenchmarkTask(Workspace(grid), 2, Task((0, 0), (1, 1))).name == "my_map_1_2"


def test_tasks_are_found_for_inflated_maps() -> None:
    tasks = select_tasks(["bundled:maze"], robot=Robot.disc(1.0)).tasks
    assert [task.task for task in tasks] == [
        task.task for task in select_tasks(["bundled:maze"]).tasks
    ]
    assert {task.grid.name for task in tasks} == {"maze (inflated by 1)"}


def test_unsolvable_tasks_of_a_suite_are_left_out_before_some_are_chosen(tmp_path: Path) -> None:
    cells = ["." * 40] * 20 + ["W" * 40] * 2 + ["." * 40] * 18
    path = tmp_path / "lake.map"
    path.write_text("\n".join(["type octile", "height 40", "width 40", "map", *cells]) + "\n")
    ends = [(5, 5, 5, 5), (5, 5, 6, 5), (5, 5, 5, 20), (5, 5, 5, 30), (1, 1, 9, 9), (1, 1, 39, 19)]
    lines = ["\t".join(("0", "lake.map", "40", "40", *map(str, end), "1")) for end in ends]
    path.with_name("lake.map.scen").write_text("\n".join(["version 1", *lines]) + "\n")
    selection = select_tasks([str(path)], tasks_per_map=2)
    assert [task.name for task in selection.tasks] == ["lake_1", "lake_5"]
    reasons = selection.left_out
    assert list(reasons) == ["lake_0", "lake_2", "lake_3"]
    assert "equal" in reasons["lake_0"] or "same" in reasons["lake_0"]
    assert "obstacle" in reasons["lake_2"]
    assert "no path" in reasons["lake_3"]


def test_maps_of_one_file_name_are_called_after_their_folders(tmp_path: Path) -> None:
    for name in ("shop", "office"):
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / "map.png"), np.full((30, 30), 255, np.uint8))
    files = [str(tmp_path / name / "map.png") for name in ("shop", "office")]
    names = [task.map_name for task in select_tasks(files, tasks_per_map=1).tasks]
    assert names == ["shop", "office"]
    named = select_tasks([files[0], f"mine={files[1]}"], tasks_per_map=1).tasks
    assert [task.map_name for task in named] == ["map", "mine"]
    tasks = tmp_path / "tasks.csv"
    tasks.write_text("map,start_x,start_y,goal_x,goal_y\noffice,1,1,9,9\nshop,2,2,9,9\n")
    starts = [task.task.start for task in select_tasks(files, str(tasks)).tasks]
    assert starts == [(2, 2), (1, 1)]


def test_random_tasks_can_be_shorter_than_half_the_map(image: str) -> None:
    tasks = select_tasks([image], tasks_per_map=20, least_distance=30).tasks
    lengths = [np.hypot(*np.subtract(task.task.goal, task.task.start)) for task in tasks]
    assert 30 <= min(lengths) < 128
