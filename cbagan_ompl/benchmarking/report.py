"""The results of a benchmark as JSON and as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from math import isfinite
from typing import Any

from ..common.markdown import table
from ..common.text import one_line
from .intervals import Interval
from .logs import HOSTS
from .settings import BASELINE, Settings
from .statistics import Results, Summary, nodes_key, within_key

# Tasks left out that the report names.
_SHOWN_LEFT_OUT = 10

_EFFORT = {"final_cost": "final cost", "collision_checks": "checks"}

_NOTES = """\
Medians over the tasks of the medians over the runs, with bootstrap 95 % intervals. Times are of
planning alone unless inference is named; costs are multiples of the best known cost of the task. A
run that did not get there counts with the time limit, and with an infinite cost: "> 500 (60%)" and
"none (60%)" say that the median run did not get there, and the fraction that did not.
"""

_RATIO_NOTES = """\
Below 1 is better than OMPL's own sampler with the same planner. **+** better and **-** worse are
ratios whose interval does not contain 1.
"""


@dataclass(frozen=True)
class Conditions:
    """The conditions of a benchmark, which are reported beside its results.

    Attributes:
        ompl_version: version of the installed OMPL.
        tasks: number of tasks that have been run.
        settings: what was compared.
        failures: for each task that failed the end of its output.
        command: command that repeats the benchmark.
        hosts: number of tasks that each host has run, by its name.
        left_out: why a task cannot be planned for, by its name.
        auto: number of tasks by the sampler that ``auto`` stood for.
    """

    ompl_version: str
    tasks: int
    settings: Settings
    failures: Mapping[str, str]
    command: str
    hosts: Mapping[str, int] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    auto: Mapping[str, int] = field(default_factory=dict)


def warn_of_hosts(hosts: Mapping[str, int]) -> str:
    """Return a warning where tasks were run on different hosts, nothing where one ran them all.

    Args:
        hosts: number of tasks by host; that of a task whose runs were done on several names them,
            with :data:`.logs.HOSTS` between.

    Example:
        >>> warn_of_hosts({"alpha": 4})
        ''
        >>> print(warn_of_hosts({"alpha": 1, "beta": 2}))
        the tasks were run on several hosts (alpha: 1, beta: 2): ratios, which compare samplers on
        one task, hold; times are those of different machines
    """
    if len(hosts) < 2 and not any(HOSTS in host for host in hosts):
        return ""
    counted = ", ".join(f"{one_line(host)}: {count}" for host, count in sorted(hosts.items()))
    if any(HOSTS in host for host in hosts):
        return (
            f"runs on one task were done on several hosts ({counted}): neither times nor ratios\n"
            "compare samplers"
        )
    return (
        f"the tasks were run on several hosts ({counted}): ratios, which compare samplers on\n"
        "one task, hold; times are those of different machines"
    )


def summary_json(results: Results, conditions: Conditions) -> dict[str, Any]:
    """Return all statistics, JSON-ready; infinite values become None."""
    return {
        "ompl_version": conditions.ompl_version,
        "tasks": conditions.tasks,
        "hosts": dict(conditions.hosts),
        "auto": dict(conditions.auto),
        "left_out": dict(conditions.left_out),
        "settings": conditions.settings.to_dict(),
        "failures": dict(conditions.failures),
        "command": conditions.command,
        **_replace_infinite(asdict(results)),
    }


def _replace_infinite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _replace_infinite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_replace_infinite(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def markdown(results: Results, conditions: Conditions) -> str:
    """Return the report."""
    settings = conditions.settings
    parts = [
        "# Benchmark",
        f"OMPL {conditions.ompl_version}, {conditions.tasks} tasks, {settings.runs} runs of "
        f"each planner with each sampler on each, {settings.time:g} s a run.",
        f"    {conditions.command}",
        *filter(
            None, [_describe_sources(conditions), warn_of_hosts(conditions.hosts).capitalize()]
        ),
        "## Results",
        _measures_table(results.overall, settings.within),
        _NOTES,
    ]
    if any(summary.ratios for summary in results.overall):
        parts += [
            f"## Ratios to {BASELINE}",
            _ratios_table(results.overall, settings.within),
            _RATIO_NOTES,
            "## Ratios by kind of map",
            _kinds_table(results.families, settings.within),
        ]
    if conditions.left_out:
        parts += ["## Tasks left out", *describe_left_out(conditions.left_out)]
    if conditions.failures:
        failed = conditions.failures.items()
        parts += ["## Tasks that failed"]
        parts += [
            "\n".join(f"- {name}: {one_line(output.splitlines()[-1])}" for name, output in failed)
        ]
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def _describe_sources(conditions: Conditions) -> str:
    """Return what ``auto`` stood for."""
    return f"Auto: {_counted(conditions.auto)}." if conditions.auto else ""


def _counted(counts: Mapping[str, int]) -> str:
    """Return one name, or several, each with the number of its tasks."""
    if len(counts) == 1:
        return next(iter(counts))
    return ", ".join(f"{name} ({count})" for name, count in sorted(counts.items()))


def describe_left_out(left_out: Mapping[str, str]) -> list[str]:
    """Return how many tasks were left out and why, and the first of them by name.

    Example:
        >>> print(*describe_left_out({"city_3": "start and goal are the same"}), sep="; ")
        1 task that cannot be planned for was left out.; - city_3: start and goal are the same
    """
    count = len(left_out)
    noun, verb = ("task", "was") if count == 1 else ("tasks", "were")
    shown = list(left_out.items())[:_SHOWN_LEFT_OUT]
    lines = [f"- {name}: {one_line(reason)}" for name, reason in shown]
    if count > len(shown):
        lines.append(f"- and {count - len(shown)} more, all named in `summary.json`")
    return [f"{count} {noun} that cannot be planned for {verb} left out.", "\n".join(lines)]


def _measures_table(summaries: Sequence[Summary], within: int) -> str:
    shown = {
        "inference_s": "inference, ms",
        "first_solution_s": "first solution, ms",
        "nodes_to_first": "nodes to it",
        within_key(within): f"to {within} % of best, ms",
        nodes_key(within): "nodes to it",
        "first_cost": "first cost",
        **_EFFORT,
    }
    rows = [
        [
            summary.planner,
            summary.sampler,
            f"{summary.success:.0%}",
            *(_format_measure(summary, name) for name in shown),
        ]
        for summary in summaries
    ]
    return table(["planner", "sampler", "solved", *shown.values()], rows)


def _ratios_table(summaries: Sequence[Summary], within: int) -> str:
    shown = {
        "nodes_to_first": "nodes to first solution",
        "first_solution_s": "time to it",
        "first_solution_total_s": "with inference",
        nodes_key(within): f"nodes to {within} % of best",
        within_key(within): "time to it",
        within_key(within, total=True): "with inference",
        **_EFFORT,
    }
    rows = [_ratio_row(summary, shown) for summary in summaries if summary.ratios]
    return table(["planner", "sampler", *shown.values()], rows)


def _kinds_table(by_kind: Mapping[str, Sequence[Summary]], within: int) -> str:
    shown = {
        "first_solution_total_s": "first solution with inference",
        within_key(within, total=True): f"to {within} % of best with inference",
        "final_cost": "final cost",
    }
    rows = [
        [kind, *_ratio_row(summary, shown)]
        for kind, summaries in by_kind.items()
        for summary in summaries
        if summary.ratios
    ]
    return table(["maps", "planner", "sampler", *shown.values()], rows)


def _ratio_row(summary: Summary, shown: Iterable[str]) -> list[str]:
    ratios = (_format_ratio(summary.ratios[name]) for name in shown)
    return [summary.planner, summary.sampler, *ratios]


def _format_measure(summary: Summary, name: str) -> str:
    interval, censored = summary.measures[name], summary.censored[name]
    scale = 1000 if name.endswith("_s") else 1  # seconds are shown as milliseconds
    if not isfinite(interval.median):
        return f"none ({censored:.0%})"
    if censored >= 0.5:
        return f"> {interval.median * scale:.3g} ({censored:.0%})"
    return f"{interval.median * scale:.4g} ({_format_range(interval, scale)})"


def _format_range(interval: Interval, scale: float = 1) -> str:
    bounds = (interval.low, interval.high)
    return " to ".join(f"{b * scale:.4g}" if isfinite(b) else "∞" for b in bounds)


def _format_ratio(interval: Interval) -> str:
    mark = " **+**" if interval.high < 1 else " **-**" if interval.low > 1 else ""
    median = f"{interval.median:.3g}" if isfinite(interval.median) else "∞"
    return f"{median} ({_format_range(interval)}){mark}"
