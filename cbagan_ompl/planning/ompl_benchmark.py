"""One task, many planners and samplers: what drives ``ompl.tools.Benchmark``."""

from __future__ import annotations

import errno
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any
from zlib import crc32

import numpy as np

from ..common.validation import whole_number
from ..sampling.heatmap import Heatmap
from ..sampling.options import SamplerOptions
from . import compat
from .attach import Attachment, attach
from .benchmark_checks import GuardedChecker, WatchedMotions
from .compat import ou
from .heatmap_sources import HeatmapSource
from .hooks import check_planner, hangs_at_optimum
from .improvements import Improvement
from .interrupt_guard import InterruptGuard
from .paths import checked_path, path_cost
from .problem import (
    make_setup,
    search_to_the_end,
    set_parameter,
    set_range,
    stop_at_optimum,
)
from .workspace import Endpoints, Workspace

# Points of the progress data that OMPL records for each run, and their least distance in time.
_UPDATES, _LEAST_UPDATE_S = 50, 0.001

_MEMORY_MB = 8192.0


@dataclass(frozen=True)
class PlannerVariant:
    """A planner with a sampler, as one of the planners of a Benchmark.

    Attributes:
        planner: OMPL's name of the planner.
        sampler: what the sampler is called.
        source: makes the heat map of a task; None for OMPL's own sampler.
        parameters: (name, value) of parameters of the planner, see :func:`.set_parameter`.
        sampler_changes: (field, value) of sampler options that differ from those of the runs.
        simplify: whether OMPL's path simplifier shortens the path after a run.
    """

    planner: str
    sampler: str
    source: HeatmapSource | None
    parameters: tuple[tuple[str, Any], ...] = ()
    sampler_changes: tuple[tuple[str, Any], ...] = ()
    simplify: bool = False

    @property
    def name(self) -> str:
        """Its name in the Benchmark."""
        return f"{self.planner}_{self.sampler}"


@dataclass(frozen=True)
class RunRecord:
    """What OMPL's log does not know of a run.

    Attributes:
        inference_s: making the heat map and attaching it; 0 for OMPL's own sampler.
        sample_counts: samples that the planner had, learned and uniform.
        collision_checks: motions that were checked.
        cost: length of the planner's path where it is exact and passed the check again, otherwise
            infinite.
        improvements: each better solution that was seen while the planner planned; empty for
            planners that do not tell the cost of their best solution.
        nodes: that the planner has added; None where that is not told.
        simplify_s: seconds in OMPL's path simplifier; None where it was not called.
        simplified_cost: length of the path afterwards, as ``cost``; infinite where it was not.
    """

    inference_s: float
    sample_counts: dict[str, int]
    collision_checks: int
    cost: float
    improvements: list[Improvement]
    nodes: int | None = None
    simplify_s: float | None = None
    simplified_cost: float = inf

    @property
    def final_cost(self) -> float:
        """Length of the path that the run ends with."""
        return self.cost if self.simplify_s is None else self.simplified_cost


@dataclass(frozen=True)
class Recording:
    """What came out of the runs on one task.

    Attributes:
        logs: OMPL's own logs, one for each round.
        runs: for each variant, by its name, what the logs do not know, round by round.
    """

    logs: list[str]
    runs: dict[str, list[RunRecord]]


@dataclass(frozen=True)
class RunOptions:
    """How often and how long the planners run.

    Attributes:
        runs: of each variant.
        time: limit of a run, seconds.
        range: longest edge of the planners that have this parameter, world units; OMPL's choice
            for None.
        tolerance: how far from the goal a path may end, world units.
        sampler: how samples follow the heat maps; its seed, an int, is OMPL's as well (None: 0).
    """

    runs: int
    time: float
    range: float | None = None
    tolerance: float = 0.0
    sampler: SamplerOptions = field(default_factory=SamplerOptions)

    @property
    def seed(self) -> int:
        """The seed of OMPL's generators."""
        return whole_number("seed", self.sampler.seed or 0, 0)  # type: ignore[arg-type]


def check_variants(
    workspace: Workspace,
    endpoints: Endpoints,
    variants: Sequence[PlannerVariant],
    options: RunOptions,
) -> None:
    """Raise if a variant cannot run; arguments as for :func:`run_benchmark`.

    Raises:
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ConfigError: a parameter that a planner does not have.
    """
    for variant in variants:
        check_planner(variant.planner, follows_heatmap=variant.source is not None)
    BenchmarkSession(workspace, endpoints, variants, options, InterruptGuard())


def run_benchmark(
    name: str,
    workspace: Workspace,
    endpoints: Endpoints,
    variants: Sequence[PlannerVariant],
    options: RunOptions,
    after_round: Callable[[], None] = lambda: None,
) -> Recording:
    """Run OMPL's Benchmark on a task.

    Benchmark does all runs of a planner before it turns to the next one, so that one of them may
    get the quieter machine. It is therefore asked for one run of each, as many times as there are
    to be runs: the variants take turns.

    Args:
        name: what the experiment is called.
        workspace: the robot on its map.
        endpoints: start and goal, as from :meth:`.Workspace.check_task`.
        variants: planners with their samplers.
        options: how often and how long they run.
        after_round: called after each round of runs.

    Raises:
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ConfigError: a parameter that a planner does not have.
        OSError: OMPL cannot write its log, as on a full disk.
        KeyboardInterrupt: after an interrupt, once the run that it came in is over.
    """
    with compat.log_level(ou.LOG_ERROR), TemporaryDirectory() as folder, InterruptGuard() as guard:
        compat.seed_ompl(options.seed)
        session = BenchmarkSession(workspace, endpoints, variants, options, guard)
        benchmark = compat.new_benchmark(
            session.setup, name, guard.wrap(session.before_run), guard.wrap(session.after_run)
        )
        for planner in session.planners.values():
            benchmark.addPlanner(planner)
        session.prepare_round()  # the first call of a network takes longer than the others
        logs: list[str] = []
        while len(logs) < options.runs and not guard.tripped:
            session.prepare_round()
            benchmark.benchmark(_one_run(options.time))
            logs.append(_save_log(benchmark, Path(folder) / "round.log"))
            after_round()
        session.end_run()
        return Recording(logs, session.records)


def _save_log(benchmark: Any, path: Path) -> str:
    """Return the log of a Benchmark, by way of a file.

    Raises:
        OSError: OMPL has not written it to its end; it does not say so itself.
    """
    path.unlink(missing_ok=True)
    benchmark.saveResultsToFile(str(path))
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    if not text.endswith("\n.\n"):
        raise OSError(errno.ENOSPC, "OMPL cannot write its log to the end", str(path))
    return text


def _one_run(time: float) -> Any:
    request = compat.benchmark_request()
    request.maxTime = float(time)
    request.maxMem = _MEMORY_MB
    request.runCount = 1
    request.timeBetweenUpdates = max(time / _UPDATES, _LEAST_UPDATE_S)
    request.displayProgress = False
    request.saveConsoleOutput = False
    request.simplify = False
    return request


class BenchmarkSession:
    """The planner variants on one setup, and the events around their runs."""

    def __init__(
        self,
        workspace: Workspace,
        endpoints: Endpoints,
        variants: Sequence[PlannerVariant],
        options: RunOptions,
        guard: InterruptGuard,
    ) -> None:
        self.setup = make_setup(workspace, endpoints, options.tolerance)
        si = self.setup.getSpaceInformation()
        checker, motions = workspace.make_checks(si)
        self._states = GuardedChecker(si, checker, guard)
        self._motions = WatchedMotions(si, motions)
        self.setup.setStateValidityChecker(self._states)
        si.setMotionValidator(self._motions)
        self.planners = {variant.name: self._planner(variant, options) for variant in variants}
        # Benchmark sets the setup up, which would make a planner of OMPL's choice without one.
        self.setup.setPlanner(next(iter(self.planners.values())))
        self.records: dict[str, list[RunRecord]] = {variant.name: [] for variant in variants}
        self._workspace, self._endpoints, self._options = workspace, endpoints, options
        self._variants = {variant.name: variant for variant in variants}
        self._sources = {e.sampler: e.source for e in variants if e.source is not None}
        self._heatmaps: dict[str, tuple[Heatmap, float]] = {}
        self._attachment: Attachment | None = None
        self._inference_s = 0.0

    def _planner(self, variant: PlannerVariant, options: RunOptions) -> Any:
        planner = compat.planner_class(variant.planner)(self.setup.getSpaceInformation())
        if options.range is not None:
            set_range(planner, options.range)
        for name, value in variant.parameters:
            set_parameter(planner, name, value)
        planner.setName(variant.name)
        return planner

    def prepare_round(self) -> None:
        """Make the heat maps that the planners of a round share."""
        positions = [endpoint[:2] for endpoint in self._endpoints]
        for sampler, source in self._sources.items():
            began = perf_counter()
            heatmap = self._workspace.adapt(source)(self._workspace.grid, *positions)
            self._heatmaps[sampler] = heatmap, perf_counter() - began

    def before_run(self, planner: Any) -> None:
        """Attach the planner of a run: Benchmark's pre-run event, which has cleared it."""
        variant = self._variants[planner.getName()]
        instance = self.planners[variant.name]
        self._inference_s = 0.0
        if variant.sampler in self._heatmaps:
            heatmap, made_in = self._heatmaps[variant.sampler]
            options = replace(
                self._options.sampler,
                seed=self._rng_of_run(variant),
                **dict(variant.sampler_changes),
            )
            self.setup.setPlanner(instance)
            began = perf_counter()
            self._attachment = attach(self.setup, heatmap, options)
            self._inference_s = made_in + perf_counter() - began
        # The objective is that of all planners, and the threshold that of one of them.
        if hangs_at_optimum(variant.planner):
            stop_at_optimum(self.setup, self._endpoints, self._options.tolerance)
        else:
            search_to_the_end(self.setup)
        self._motions.begin_run(instance, variant.planner)

    def _rng_of_run(self, variant: PlannerVariant) -> np.random.Generator:
        """Return the generator of a run, which does not depend on how long others have run."""
        number = len(self.records[variant.name])
        return np.random.default_rng([self._options.seed, crc32(variant.name.encode()), number])

    def after_run(self, planner: Any, _: Any) -> None:
        """Record a run: Benchmark's post-run event.

        What the event could add to the log, OMPL 2.0 would drop.
        """
        counts = {"learned": 0, "uniform": 0}
        if self._attachment is not None:
            counts = self._attachment.sample_counts
        checks, nodes = self._motions.checks, self._motions.nodes
        improvements = self.end_run()
        cost = self._cost()
        record = RunRecord(self._inference_s, counts, checks, cost, improvements, nodes)
        variant = self._variants[planner.getName()]
        if variant.simplify and isfinite(cost):
            record = self._simplify(record)
        self.records[variant.name].append(record)

    def _simplify(self, record: RunRecord) -> RunRecord:
        began = perf_counter()
        self.setup.simplifySolution()
        seconds = perf_counter() - began
        return replace(record, simplify_s=seconds, simplified_cost=self._cost())

    def end_run(self) -> list[Improvement]:
        """Detach and let go of the planner; return the improvements that were seen.

        To be called at the end too, because after an exception there is no post-run event.
        """
        if self._attachment is not None:
            self._attachment.force_detach()
            self._attachment = None
        return self._motions.end_run()

    def _cost(self) -> float:
        if not self.setup.getProblemDefinition().hasExactSolution():
            return inf
        path = checked_path(self.setup, self._workspace, self._endpoints, self._options.tolerance)
        return inf if path is None else path_cost(self.setup, self._workspace, path)
