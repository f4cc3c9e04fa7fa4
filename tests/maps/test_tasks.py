"""Tasks from .scen and .csv files, and those that come with a map."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from helpers.fuzzing import mutations, read_all

from cbagan_ompl.errors import MapError
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.loading import bundled_maps
from cbagan_ompl.maps.tasks import Task, load_tasks, tasks_of

GRID = GridMap(np.ones((4, 6)), name="arena")
SCEN = (
    "version 1\n0\tarena.map\t6\t4\t0\t1\t5\t3\t6.82842712\n3\tarena.map\t6\t4\t2\t2\t0\t0\t2.8\n"
)


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


# --- .scen ------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", [SCEN, SCEN.replace("version 1", "version 1.0\r"), SCEN + "\n\n"])
def test_scen_cells_become_pixel_centres(tmp_path, text):
    assert load_tasks(written(tmp_path / "a.scen", text), GRID) == [
        Task((0.5, 1.5), (5.5, 3.5)),
        Task((2.5, 2.5), (0.5, 0.5)),
    ]


def test_scen_fields_may_be_separated_by_spaces_or_hold_them(tmp_path):
    for name in ("arena.map", "my maps/arena.map"):
        text = SCEN.replace("arena.map", name)
        assert len(load_tasks(written(tmp_path / "a.scen", text), GRID)) == 2
    assert len(load_tasks(written(tmp_path / "a.scen", SCEN.replace("\t", " ")), GRID)) == 2


def test_scen_is_scaled_to_the_map(tmp_path):
    path = written(tmp_path / "a.scen", SCEN)
    double = GridMap(np.ones((8, 12)))
    assert load_tasks(path, double)[0] == Task((1.5, 3.5), (11.5, 7.5))
    half = GridMap(np.ones((2, 3)))
    assert load_tasks(path, half)[0] == Task((0.5, 0.5), (2.5, 1.5))


def test_scen_is_in_world_coordinates(tmp_path):
    grid = GridMap(np.ones((4, 6)), 0.5, (10, 20, 0))
    task = load_tasks(written(tmp_path / "a.scen", SCEN), grid)[0]
    assert task == Task((10.25, 21.25), (12.75, 20.25))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: a scenario file begins with 'version 1'"),
        ("version 2\n", "line 1: .*'version 2'"),
        ("version 1\n", "no scenario follows"),
        (SCEN.replace("\t6.82842712", ""), "line 2: expected 9 fields .* found 8"),
        (SCEN.replace("2.8", "2.8\t9"), "line 3: expected 9 fields .* found 10"),
        (SCEN.replace("\t2\t2\t", "\t2\ttwo\t"), "line 3: not a number: .*'two'"),
        (SCEN.replace("2.8", "far"), "line 3: not a number: .*'far'"),
        (SCEN.replace("\t5\t3", "\t6\t3"), r"line 2: goal \(6, 3\) is outside a map of 6 x 4"),
        (SCEN.replace("\t0\t1", "\t0\t-1"), r"line 2: start \(0, -1\) is outside"),
        (SCEN.replace("\t6\t4", "\t0\t4"), "line 2: the map size 0 x 4 must be positive"),
    ],
)
def test_scen_broken(tmp_path, text, message):
    with pytest.raises(MapError, match=message):
        load_tasks(written(tmp_path / "a.scen", text), GRID)


# --- .csv -------------------------------------------------------------------------------------

HEAD = "map,start_x,start_y,goal_x,goal_y,optimal_cost\n"


def test_csv_rows_of_this_map(tmp_path):
    text = HEAD + (
        "arena,0.5,1,2,3.25,4.5\nother,1,1,2,2,\nmaps/arena.map,1,1,2,2,\n"
        "maps\\arena.png,1,1,3,3,0\n"
    )
    assert load_tasks(written(tmp_path / "t.csv", text), GRID) == [
        Task((0.5, 1.0), (2.0, 3.25), 4.5),
        Task((1.0, 1.0), (2.0, 2.0), None),
        Task((1.0, 1.0), (3.0, 3.0), 0.0),
    ]


def test_csv_columns_in_any_order_with_others(tmp_path):
    text = "\ufeffgoal_x, goal_y,family,map,start_x,start_y\r\n3,4,city,arena.v2,1,2\r\n"
    grid = GridMap([[1]], name="arena.v2")
    assert load_tasks(written(tmp_path / "t.csv", text), grid) == [
        Task((1, 2), (3, 4), family="city")
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: missing columns: map, start_x, start_y, goal_x, goal_y"),
        ("map,start_x,start_y\n", "missing columns: goal_x, goal_y"),
        (HEAD, "no task for the map 'arena', only for none"),
        (HEAD + "b,1,1,2,2,\na,1,1,2,2,\n", "no task for the map 'arena', only for a, b"),
        (HEAD + "b,1,1,2,2,\narena,1,1,2\n", "line 3: expected 6 fields"),
        (HEAD + "arena,1,1,2,2,3,4\n", "line 2: expected 6 fields"),
        (HEAD + "arena,1,x,2,2,\n", "line 2: start_y must be a finite number, got 'x'"),
        (HEAD + "arena,1,,2,2,\n", "line 2: start_y must be a finite number, got ''"),
        (HEAD + "arena,1,1,2,inf,\n", "line 2: goal_y must be a finite number"),
        (HEAD + "arena,1,1,2,2,nan\n", "line 2: optimal_cost must be a finite number"),
        (HEAD + "arena,1,1,2,2,-1\n", "line 2: optimal_cost is a length"),
        (HEAD + "arena" + "a" * 200_000 + ",1,1,2,2,\n", "line 2: field larger"),
    ],
)
def test_csv_broken(tmp_path, text, message):
    with pytest.raises(MapError, match=message):
        load_tasks(written(tmp_path / "t.csv", text), GRID)


def test_other_files(tmp_path):
    with pytest.raises(MapError, match=r"unknown kind of task file; known are \.scen and \.csv"):
        load_tasks(tmp_path / "tasks.json", GRID)
    for name in ("none.csv", "none.scen"):
        with pytest.raises(MapError, match=r"cannot read .*none"):
            load_tasks(tmp_path / name, GRID)
    (tmp_path / "binary.csv").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(MapError, match="no text file"):
        load_tasks(tmp_path / "binary.csv", GRID)


@pytest.mark.parametrize("name", ["t.csv", "t.scen"])
@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"1,2\n" * 3_000_000, "more than the 8 MiB"),
        (b"version 1" + b"\n" * 2**22, "4194304 lines, at most 100000"),
        (b"version 1" + b"\r" * 2**22, "4194304 lines, at most 100000"),
        (b"version 1\n" + b"1\t" * 2**21, "line 2: expected 9 fields|line 1: missing columns"),
    ],
)
def test_large_files_are_refused_early(tmp_path, name, data, message):
    (tmp_path / name).write_bytes(data)
    tracemalloc.start()
    try:
        with pytest.raises(MapError, match=message) as caught:
            load_tasks(tmp_path / name, GRID)
        assert tracemalloc.get_traced_memory()[1] < 2e8
    finally:
        tracemalloc.stop()
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("number", ["9" * 4000, "9" * 5000, "16385"])
def test_huge_numbers_in_scen(tmp_path, number):
    text = SCEN.replace("\t6\t4\t", f"\t{number}\t4\t")
    with pytest.raises(MapError, match=r"line 2: ") as caught:
        load_tasks(written(tmp_path / "a.scen", text), GRID)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.scen", SCEN),
        ("t.csv", HEAD + 'arena,0.5,1,2,3.25,4.5\n"a,b",1,1,2,2,\narena,1e0,1,2,2,inf\n'),
    ],
)
def test_damaged_files_are_read_or_refused(tmp_path, name, text):
    path = tmp_path / name

    def read(data):
        path.write_bytes(data)
        for task in load_tasks(path, GRID):
            GRID.check_task(task.start, task.goal)

    counts = read_all(read, mutations([text.encode(), text.encode() * 2], 1500, 1))
    assert min(counts["read"], counts["refused"]) > 20


# --- tasks of a map ---------------------------------------------------------------------------


def test_tasks_beside_a_moving_ai_map(tmp_path):
    path = written(tmp_path / "arena.map", "type octile\nheight 4\nwidth 6\nmap\n" + "......\n" * 4)
    assert tasks_of(path, GridMap.load(path)) == []
    written(tmp_path / "arena.scen", SCEN)
    assert len(tasks_of(str(path), GRID)) == 2
    written(tmp_path / "arena.map.scen", SCEN[: SCEN.index("3\tarena")])  # has precedence
    assert len(tasks_of(path, GRID)) == 1


def test_names_with_no_room_for_another_suffix(tmp_path):
    path = tmp_path / ("x" * 251 + ".map")
    path.write_text("type octile\nheight 4\nwidth 6\nmap\n" + "......\n" * 4)
    assert tasks_of(path, GRID) == []


def test_other_maps_come_without_tasks(tmp_path):
    written(tmp_path / "arena.scen", SCEN)
    assert tasks_of(tmp_path / "arena.png", GRID) == []


@pytest.mark.parametrize("name", bundled_maps())
def test_bundled_tasks_can_be_planned_for(name):
    grid = GridMap.load(f"bundled:{name}")
    tasks = tasks_of(f"bundled:{name}", grid)
    assert len(tasks) == 4
    for task in tasks:
        start, goal = grid.check_task(task.start, task.goal)
        assert np.hypot(*(goal - start)) > 50
        assert not grid.path_is_free([start, goal])
        assert grid.inflated(1.0).is_free([start, goal]).all()  # not scraping along a wall


def test_scenarios_of_other_proportions_belong_to_another_map(tmp_path):
    path = tmp_path / "arena.scen"
    path.write_text("version 1\n0\tarena.map\t30\t20\t1\t1\t25\t15\t30\n")
    assert len(load_tasks(path, GridMap(np.ones((40, 60), bool)))) == 1
    assert len(load_tasks(path, GridMap(np.ones((41, 60), bool)))) == 1, "rounded when scaled"
    for shape in ((30, 20), (21, 30), (20, 29)):  # of which the last two would not be scaled
        with pytest.raises(MapError, match="sizes in other proportions"):
            load_tasks(path, GridMap(np.ones(shape, bool)))
