"""The tables of the benchmark's suites, and of the studies beside them, from the result files."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

from planner_tables import RATIOS_OF_TIME, Json, ratios_table, times_table

from cbagan_ompl.common.markdown import table

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results"
VERSIONS = ("2.0.1", "1.7.0")
SUITES = ("real_maps", "street_maps", "nav2_maps", "bundled", "paper_suite")
TABLE_BEGINS, TABLE_ENDS = "<!-- results -->", "<!-- end of results -->"


def read(path: str | Path) -> Json:
    """Return the content of a JSON file; a relative path begins in benchmarks/results."""
    content: Json = json.loads((RESULTS / path).read_text(encoding="utf-8"))
    return content


def suite_tables() -> dict[str, Callable[[], str]]:
    """Return what makes the tables of each suite: ratios for each OMPL, and milliseconds."""
    makers: dict[str, Callable[[], str]] = {}
    for suite in SUITES:
        makers[suite] = partial(suite_ratios, suite)
        makers[f"{suite}_times"] = partial(suite_times, suite)
    return makers


def versions_of(suite: str) -> list[str]:
    """Return the versions of OMPL for which a suite has results."""
    return [one for one in VERSIONS if (RESULTS / f"{suite}_ompl_{one}.json").exists()]


def or_note(make: Callable[[], str]) -> str:
    """Return a table, or a note where its result file has not been made yet."""
    try:
        return make()
    except FileNotFoundError as error:
        return f"*Not measured yet: `benchmarks/results/{Path(error.filename).name}`.*"


def suite_ratios(suite: str) -> str:
    return "\n\n".join(
        f"OMPL {version}:\n\n{ratios_table(read(f'{suite}_ompl_{version}.json'))}"
        for version in versions_of(suite) or VERSIONS[:1]
    )


def suite_times(suite: str) -> str:
    return times_table(read(f"{suite}_ompl_{VERSIONS[0]}.json"), ("uniform", "learned", "corridor"))


def overview() -> str:
    summary = read(f"real_maps_ompl_{VERSIONS[0]}.json")
    planners = ("RRT", "RRTConnect", "RRTstar", "InformedRRTstar")
    return ratios_table(summary, RATIOS_OF_TIME, ("learned", "corridor"), planners)


def with_table(text: str) -> str:
    """Return the text of the README with its table made anew."""
    before, begin, rest = text.partition(TABLE_BEGINS)
    _, end, after = rest.partition(TABLE_ENDS)
    return f"{before}{begin}\n{overview()}\n{end}{after}"


def conditions() -> str:
    """Return what the suites ran with: tasks, runs, choices of ``auto``."""
    rows = []
    for suite in SUITES:
        for version in versions_of(suite):
            summary = read(f"{suite}_ompl_{version}.json")
            settings = summary["settings"]
            auto = ", ".join(f"{name} ({n})" for name, n in sorted(summary["auto"].items()))
            runs = f"{settings['runs']} of {settings['time']:g} s"
            left_out = str(len(summary["left_out"]))
            rows.append([suite, version, str(summary["tasks"]), left_out, runs, auto or "-"])
    header = ["suite", "OMPL", "tasks", "left out", "runs", "`auto` stands for"]
    return table(header, rows)


def rrtconnect() -> str:
    rows = []
    for version in VERSIONS:
        for length, by_condition in read(f"rrtconnect_ompl_{version}.json")["ranges"].items():
            for condition, samplers in by_condition.items():
                for sampler, row in samplers.items():
                    ratio = "{:.2f} [{:.2f}, {:.2f}]".format(*row["processor_ratio"])
                    times = [
                        f"{row[f'{clock}_ms{of}']:.3g} ms"
                        for clock in ("clock", "processor")
                        for of in ("", "_p90")
                    ]
                    lengths = [f"{row[f'simplified_length{of}']:.3f}" for of in ("", "_p90")]
                    rows.append([version, length, condition, sampler, *times, ratio, *lengths])
    header = ["OMPL", "range", "condition", "sampler", "clock", "90 %", "processor", "90 %"]
    return table([*header, "ratio", "length, simplified", "90 %"], rows)


def overhead() -> str:
    result = read("overhead.json")
    ratios = result["ratios"]
    cells = [f"{value:.3f}" for value in (result["median"], min(ratios), max(ratios))]
    return table(["OMPL", "median", "least", "most"], [[result["ompl"], *cells]])
