"""One task, many planners and samplers: what drives ``ompl.tools.Benchmark``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from ..maps.grid_map import GridMap
from ..sampling.adaptation import FULL_ADAPTATION, Adaptation
from ..sampling.heatmap import Heatmap
from ..sampling.sampler import DEFAULT_UNIFORM_FRACTION
from . import compat
from .attach import Attachment, attach
from .compat import ou
from .hooks import hook_of
from .interrupt_guard import InterruptGuard
from .monitor import CostHistory
from .plan import HeatmapSource
from .problem import Endpoints, checked_path, path_length, set_parameter, set_range, simple_setup
from .validity import GridMotionValidator, GridValidityChecker

# Collision checks between two looks at the best cost: about six iterations of RRT*, half a
# millisecond.
_LOOK_EVERY = 32

# Points of the progress data that OMPL records for each run, and their least distance in time.
_UPDATES, _LEAST_UPDATE_S = 50, 0.001

_MEMORY_MB = 8192.0


@dataclass(frozen=True)
class PlannerVariant:
    """A planner with a sampler, as one of the planners of a Benchmark.

    Attributes:
        planner: OMPL's name of the planner.
        sampler: what the sampler is called.
        provide: makes the heat map of a task; None for OMPL's own sampler.
        parameters: (name, value) of parameters of the planner, see :func:`.set_parameter`.
    """

    planner: str
    sampler: str
    provide: HeatmapSource | None
    parameters: tuple[tuple[str, Any], ...] = ()

    @property
    def name(self) -> str:
        """Its name in the Benchmark."""
        return f"{self.planner}_{self.sampler}"


@dataclass(frozen=True)
class RunRecord:
    """What OMPL's log does not know of a run.

    Attributes:
        inference_s: making the heat map and attaching it; 0 for OMPL's own sampler.
        draws: draws that the planner had, learned and uniform.
        collision_checks: motions that were checked.
        cost: length of the path where it is exact and passed the check again, otherwise infinite.
        costs: (seconds, cost) of each better solution that was seen while the planner planned;
            empty for planners that do not tell the cost of their best solution.
    """

    inference_s: float
    sample_counts: dict[str, int]
    collision_checks: int
    cost: float
    costs: list[tuple[float, float]]


@dataclass(frozen=True)
class Recording:
    """What came out of the runs on one task.

    Attributes:
        logs: OMPL's own logs, one for each round.
        runs: for each entrant, by its name, what the logs do not know, round by round.
    """

    logs: list[str]
    runs: dict[str, list[RunRecord]]


@dataclass(frozen=True)
class RunOptions:
    """How often and how long the planners run.

    Attributes:
        runs: of each entrant.
        time: limit of a run, seconds.
        range: longest edge of the planners that have this parameter, world units; OMPL's choice
            for None.
        tolerance: how far from the goal a path may end, world units.
        uniform_fraction: share of draws that stays uniform over free space, in (0, 1].
        adaptation: how the share of a heat map changes meanwhile, see
            :mod:`cbagan_ompl.sampling.adaptation`.
        sharpness: power of a heat map that draws follow; what suits each planner for None.
        seed: at least 0; of OMPL's generators and of the draws.
    """

    runs: int
    time: float
    range: float | None = None
    tolerance: float = 0.0
    uniform_fraction: float = DEFAULT_UNIFORM_FRACTION
    adaptation: Adaptation = FULL_ADAPTATION
    sharpness: float | None = None
    seed: int = 0


def check_variants(
    grid: GridMap, task: Endpoints, entrants: Sequence[PlannerVariant], options: RunOptions
) -> None:
    """Refuse entrants that cannot run; arguments as for :func:`run_benchmark`.

    Raises:
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ConfigError: a parameter that a planner does not have.
    """
    BenchmarkSession(grid, task, entrants, options, InterruptGuard())
    for entrant in entrants:
        if entrant.provide is not None:
            hook_of(entrant.planner)


def run_benchmark(
    name: str,
    grid: GridMap,
    task: Endpoints,
    entrants: Sequence[PlannerVariant],
    options: RunOptions,
    after_round: Callable[[], None] = lambda: None,
) -> Recording:
    """Run OMPL's Benchmark on a task.

    Benchmark does all runs of a planner before it turns to the next one, so that one of them may
    get the quieter machine. It is therefore asked for one run of each, as many times as there are
    to be runs: the entrants take turns.

    Args:
        name: what the experiment is called.
        grid: the map.
        task: start and goal, as from :meth:`GridMap.check_task`.
        entrants: planners with their samplers.
        options: how often and how long they run.
        after_round: called after each round of runs.

    Raises:
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ConfigError: a parameter that a planner does not have.
        KeyboardInterrupt: after an interrupt, once the run that it came in is over.
    """
    with compat.log_level(ou.LOG_ERROR), TemporaryDirectory() as folder, InterruptGuard() as guard:
        compat.seed_ompl(options.seed)
        contest = BenchmarkSession(grid, task, entrants, options, guard)
        benchmark = compat.new_benchmark(
            contest.setup, name, guard.wrap(contest.before_run), guard.wrap(contest.after_run)
        )
        for planner in contest.planners.values():
            benchmark.addPlanner(planner)
        contest.prepare_round()  # the first call of a network takes longer than the others
        logs: list[str] = []
        while len(logs) < options.runs and not guard.tripped:
            contest.prepare_round()
            benchmark.benchmark(_one_run(options.time))
            log = Path(folder) / "round.log"
            benchmark.saveResultsToFile(str(log))
            logs.append(log.read_text(encoding="utf-8", errors="replace"))
            after_round()
        contest.end_run()
        return Recording(logs, contest.records)


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
    """The entrants on one setup, and the events around their runs."""

    def __init__(
        self,
        grid: GridMap,
        task: Endpoints,
        entrants: Sequence[PlannerVariant],
        options: RunOptions,
        guard: InterruptGuard,
    ) -> None:
        self.setup = simple_setup(grid, task, options.tolerance)
        si = self.setup.getSpaceInformation()
        self._motions = _Motions(si, grid)
        self.setup.setStateValidityChecker(_States(si, grid, guard))
        si.setMotionValidator(self._motions)
        self.planners = {entrant.name: self._planner(entrant, options) for entrant in entrants}
        # Benchmark sets the setup up, which would make a planner of OMPL's choice without one.
        self.setup.setPlanner(next(iter(self.planners.values())))
        self.records: dict[str, list[RunRecord]] = {entrant.name: [] for entrant in entrants}
        self._grid, self._task, self._options = grid, task, options
        self._sampler_of = {entrant.name: entrant.sampler for entrant in entrants}
        self._providers = {e.sampler: e.provide for e in entrants if e.provide is not None}
        self._heatmaps: dict[str, tuple[Heatmap, float]] = {}
        self._rng = np.random.default_rng(options.seed)
        self._link: Attachment | None = None
        self._inference_s = 0.0

    def _planner(self, entrant: PlannerVariant, options: RunOptions) -> Any:
        planner = compat.planner_class(entrant.planner)(self.setup.getSpaceInformation())
        if options.range is not None:
            set_range(planner, options.range)
        for name, value in entrant.parameters:
            set_parameter(planner, name, value)
        planner.setName(entrant.name)
        return planner

    def prepare_round(self) -> None:
        """Make the heat maps that the planners of a round share."""
        for sampler, provide in self._providers.items():
            began = perf_counter()
            heatmap = provide(self._grid, *self._task)
            self._heatmaps[sampler] = heatmap, perf_counter() - began

    def before_run(self, planner: Any) -> None:
        """Benchmark's pre-run event; it has cleared the planner."""
        name = planner.getName()
        instance = self.planners[name]
        self._inference_s = 0.0
        if self._sampler_of[name] in self._heatmaps:
            heatmap, made_in = self._heatmaps[self._sampler_of[name]]
            self.setup.setPlanner(instance)
            began = perf_counter()
            self._link = attach(
                self.setup,
                heatmap,
                self._options.uniform_fraction,
                self._rng,
                self._options.adaptation,
                self._options.sharpness,
            )
            self._inference_s = made_in + perf_counter() - began
        self._motions.begin_run(instance)

    def after_run(self, planner: Any, _: Any) -> None:
        """Benchmark's post-run event; what it could say of the run, OMPL 2.0 would drop."""
        draws = {"learned": 0, "uniform": 0} if self._link is None else self._link.sample_counts
        costs = self.end_run()
        self.records[planner.getName()].append(
            RunRecord(self._inference_s, draws, self._motions.checks, self._cost(), costs)
        )

    def end_run(self) -> list[tuple[float, float]]:
        """Detach, and let go of the planner; the costs that were seen.

        To be called at the end too, because after an exception there is no post-run event.
        """
        if self._link is not None:
            self._link.detach()
            self._link = None
        return self._motions.end_run()

    def _cost(self) -> float:
        if not self.setup.getProblemDefinition().hasExactSolution():
            return inf
        path = checked_path(self.setup, self._grid, self._task, self._options.tolerance)
        return inf if path is None else path_length(path)


class _States(GridValidityChecker):
    """Nothing is valid any more once the guard has tripped, so that runs end at once."""

    def __init__(self, si: Any, grid: GridMap, guard: InterruptGuard) -> None:
        super().__init__(si, grid)
        self._guard = guard

    def isValid(self, state: Any) -> bool:  # noqa: N802
        return not self._guard.tripped and super().isValid(state)


class _Motions(GridMotionValidator):
    """Counts the checks of a run, and now and then looks at the best cost."""

    def __init__(self, si: Any, grid: GridMap) -> None:
        super().__init__(si, grid)
        self.checks = 0
        self._history: CostHistory | None = None

    def begin_run(self, planner: Any) -> None:
        self.checks = 0
        self._history = CostHistory(planner)

    def end_run(self) -> list[tuple[float, float]]:
        """The costs that were seen; lets go of the planner, which keeps this object alive."""
        costs = [] if self._history is None else self._history.costs
        self._history = None
        return costs

    def checkMotion(self, s1: Any, s2: Any, *last_valid: Any) -> bool:  # noqa: N802
        self.checks += 1
        if self._history is not None and self.checks % _LOOK_EVERY == 0:
            self._history.look()
        return super().checkMotion(s1, s2, *last_valid)
