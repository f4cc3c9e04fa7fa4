"""The ways in which the names of planners are written, and what messages list."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import GridMap, PlannerError, plan, reached_planners
from cbagan_ompl.benchmarking.settings import Settings, parse_parameters
from cbagan_ompl.cli import main
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.hooks import PLANNERS
from cbagan_ompl.planning.planner_names import planner_name


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("RRT*", "RRTstar"),
        ("rrt*", "RRTstar"),
        ("RRT *", "RRTstar"),
        ("RRT\N{ASTERISK OPERATOR}", "RRTstar"),
        ("RRT\N{STAR OPERATOR}", "RRTstar"),
        ("rrtstar", "RRTstar"),
        ("RRT-star", "RRTstar"),
        ("rrt_star", "RRTstar"),
        ("geometric::RRTstar", "RRTstar"),
        ("og.RRTstar", "RRTstar"),
        ("RRT-Connect", "RRTConnect"),
        ("RRT Connect", "RRTConnect"),
        ("rrtconnect", "RRTConnect"),
        ("Informed RRT*", "InformedRRTstar"),
        ("informed-rrt*", "InformedRRTstar"),
        (" InformedRRT* ", "InformedRRTstar"),
        ("PRM*", "PRMstar"),
        ("Lazy PRM*", "LazyPRMstar"),
        ("SORRT*", "SORRTstar"),
        ("RRT#", "RRTsharp"),
        ("RRTX", "RRTXstatic"),
        ("BIT*", "BITstar"),
        ("FMT*", "FMT"),
        ("KPIECE", "KPIECE1"),
    ],
)
def test_spellings(written: str, name: str) -> None:
    assert planner_name(written) == name


@pytest.mark.parametrize("name", ["Magic", "RRT**", "", "*", "RRT*Connect", "RRTstarr", 3, None])
def test_what_is_no_spelling_stays(name: str) -> None:
    assert planner_name(name) == name


def test_every_planner_of_this_build_keeps_its_name() -> None:
    for name in compat.planner_names() | PLANNERS.keys():
        assert planner_name(name) == name
        assert planner_name(name.lower()) == name


def test_plan_takes_them(two_walls: GridMap) -> None:
    result = plan(two_walls, START, GOAL, "Informed RRT*", "corridor", time=0.05, seed=1)
    assert result.planner == "InformedRRTstar"
    assert result.hook == reached_planners()["InformedRRTstar"]


def test_command_line_takes_them(tmp_path: Path) -> None:
    report = tmp_path / "plan.json"
    words = ["plan", "bundled:walls_with_gaps", "--planner", "RRT*", "--sampler", "corridor"]
    main([*words, "--time", "0.1", "--json", str(report)])
    assert json.loads(report.read_text())["planner"] == "RRTstar"


def test_settings_of_a_benchmark_take_them() -> None:
    settings = Settings(
        planners=("RRT*", "rrt-connect"),
        parameters=parse_parameters(["RRT*.rewire_factor=1.2", "RRTstar.range=3"]),
    )
    assert settings.planners == ("RRTstar", "RRTConnect")
    assert settings.parameters == {"RRTstar": {"rewire_factor": 1.2, "range": 3}}


def test_messages_list_what_the_sampler_reaches(two_walls: GridMap) -> None:
    unreached = sorted(compat.planner_names() - reached_planners().keys())[0]
    lists = {}
    for sampler in ("corridor", "uniform"):
        with pytest.raises(PlannerError, match=r"no planner 'Magic' to use on OMPL \d") as caught:
            plan(two_walls, START, GOAL, "Magic", sampler)
        lists[sampler] = str(caught.value).split("; ")[1]
    assert all(name in lists["corridor"] for name in reached_planners())
    assert unreached not in lists["corridor"]
    assert unreached in lists["uniform"]


@pytest.mark.parametrize("command", ["plan", "benchmark"])
def test_help_lists_the_planners_of_this_build(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    end = shown.split(f"sample heat maps on OMPL {compat.ompl_version()}: ")[1]
    reached, others = end.split(". With the uniform sampler also: ")
    assert reached.split(", ") == list(reached_planners())
    names = {*reached.split(", "), *others.split(". ")[0].split(", ")}
    assert names == compat.planner_names()
