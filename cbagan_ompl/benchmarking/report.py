"""The results of a benchmark as JSON and as Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

from ..common.markdown import table
from .settings import BASELINE, Settings
from .statistics import Interval, Results, Summary

_MEASURES_SHOWN = {
    "inference_s": "inference, ms",
    "first_solution_s": "first solution, ms",
    "within_2_percent_s": "to 2 % of best, ms",
    "first_cost": "first cost",
    "final_cost": "final cost",
    "nodes": "nodes",
    "collision_checks": "checks",
}
_RATIOS_SHOWN = {
    "first_solution_s": "first solution",
    "first_solution_total_s": "with inference",
    "within_2_percent_s": "to 2 % of best",
    "within_2_percent_total_s": "with inference",
    "final_cost": "final cost",
    "nodes": "nodes",
    "collision_checks": "checks",
}

_RATIOS_BY_FAMILY = {
    "first_solution_total_s": "first solution with inference",
    "within_2_percent_total_s": "to 2 % of best with inference",
    "final_cost": "final cost",
}

_NOTES = """\
Medians over the tasks of the medians over the runs, with bootstrap 95 % intervals. Times are of
planning alone unless inference is named; costs are multiples of the best known cost of the task. A
run that did not get there counts with the time limit, and with an infinite cost: "> 500 (60%)" and
"none (60%)" say that the median run did not get there, and the share that did not.
"""

_RATIO_NOTES = """\
Below 1 is better than OMPL's own sampler with the same planner. **+** better and **-** worse are
ratios whose interval does not hold 1.
"""


@dataclass(frozen=True)
class Circumstances:
    """What is to be known of a benchmark beside its results.

    Attributes:
        ompl_version: of the installed OMPL.
        tasks: how many have been run.
        settings: what was compared.
        failures: tasks that failed, with their last words.
        command: that makes the same numbers again.
    """

    ompl_version: str
    tasks: int
    settings: Settings
    failures: Mapping[str, str]
    command: str


def summary_json(results: Results, circumstances: Circumstances) -> dict[str, Any]:
    """All statistics, JSON-ready; infinite values become None."""
    return _json(asdict(circumstances) | asdict(results))  # type: ignore[no-any-return]


def _json(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _json(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_json(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def markdown(results: Results, circumstances: Circumstances) -> str:
    """The report."""
    settings = circumstances.settings
    header = ["planner", "sampler", "solved", *_MEASURES_SHOWN.values()]
    parts = [
        "# Benchmark",
        f"OMPL {circumstances.ompl_version}, {circumstances.tasks} tasks, {settings.runs} runs of "
        f"each planner with each sampler on each, {settings.time:g} s a run.",
        f"    {circumstances.command}",
        "## Results",
        table(
            ["planner", "sampler", "solved", *_MEASURES_SHOWN.values()], map(_row, results.overall)
        ),
        _NOTES,
    ]
    compared = [summary for summary in results.overall if summary.ratios]
    if compared:
        header = ["planner", "sampler", *_RATIOS_SHOWN.values()]
        parts += [
            f"## Ratios to {BASELINE}",
            table(header, map(_ratio_row, compared)),
            _RATIO_NOTES,
        ]
        header = ["maps", "planner", "sampler", *_RATIOS_BY_FAMILY.values()]
        by_family = [
            (name, summary)
            for name, summaries in results.families.items()
            for summary in summaries
            if summary.ratios
        ]
        parts += ["## Ratios by kind of map", table(header, map(_family_row, by_family))]
    if circumstances.failures:
        failed = circumstances.failures.items()
        parts += ["## Tasks that failed"]
        parts += ["\n".join(f"- {name}: {words.splitlines()[-1]}" for name, words in failed)]
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def _ratio_row(summary: Summary) -> list[str]:
    ratios = (_ratio(summary.ratios[name]) for name in _RATIOS_SHOWN)
    return [summary.planner, summary.sampler, *ratios]


def _family_row(named: tuple[str, Summary]) -> list[str]:
    name, summary = named
    ratios = (_ratio(summary.ratios[measure]) for measure in _RATIOS_BY_FAMILY)
    return [name, summary.planner, summary.sampler, *ratios]


def _row(summary: Summary) -> list[str]:
    return [
        summary.planner,
        summary.sampler,
        f"{summary.success:.0%}",
        *(
            _shown(summary.measures[name], summary.censored[name], 1000 if name[-2:] == "_s" else 1)
            for name in _MEASURES_SHOWN
        ),
    ]


def _shown(interval: Interval, censored: float, scale: float) -> str:
    if not isfinite(interval.median):
        return f"none ({censored:.0%})"
    if censored >= 0.5:
        return f"> {interval.median * scale:.3g} ({censored:.0%})"
    return f"{interval.median * scale:.4g} ({_range(interval, scale)})"


def _range(interval: Interval, scale: float = 1) -> str:
    ends = (f"{end * scale:.4g}" if isfinite(end) else "∞" for end in (interval.low, interval.high))
    return " to ".join(ends)


def _ratio(interval: Interval) -> str:
    mark = " **+**" if interval.high < 1 else " **-**" if interval.low > 1 else ""
    median = f"{interval.median:.3g}" if isfinite(interval.median) else "∞"
    return f"{median} ({_range(interval)}){mark}"
