"""The one module that knows how OMPL's Python bindings differ between versions.

Two generations of wheels are served: 1.7 (Boost.Python) and 2.0 (nanobind). Features are recognised
by what the bindings offer, not by version number, so that a build that binds more is used better.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.versions import ompl_version
from ..errors import MissingDependencyError, PlannerError, show

try:
    import ompl
except ImportError as error:  # pragma: no cover - ompl is a declared dependency
    raise MissingDependencyError("this needs OMPL's Python bindings: pip install ompl") from error

#: True for the Boost.Python bindings of OMPL 1.x.
BOOST_PYTHON = hasattr(ompl, "dll_loader")
#: The generation of the bindings: "boost" (OMPL 1.7) or "nanobind" (2.0).
BINDINGS = "boost" if BOOST_PYTHON else "nanobind"

from ompl import base as ob  # noqa: E402
from ompl import geometric as og  # noqa: E402
from ompl import tools as ot  # noqa: E402
from ompl import util as ou  # noqa: E402

from .ompl_log import log_level  # noqa: E402

__all__ = [
    "BINDINGS",
    "BOOST_PYTHON",
    "HAS_STATE_SAMPLER_ALLOCATOR",
    "log_level",
    "ob",
    "og",
    "ompl_version",
    "ou",
]

#: Classes of states whose Python object may be one of another state, kept and out of date.
KEPT_STATES: Any = () if BOOST_PYTHON else ob.State

#: Whether planners can be given a StateSampler (OMPL 1.7; not bound in 2.0.0 and 2.0.1).
HAS_STATE_SAMPLER_ALLOCATOR = hasattr(ob.StateSpace, "setStateSamplerAllocator")

# Planners that crash the interpreter by themselves, without any code of ours: AORRTC (2.0.1) and
# LazyLBTRRT (1.7.0) while they plan or are freed, the others at exit after any use on 1.7.0.
_BROKEN = {"AORRTC", "LazyLBTRRT"} | ({"ABITstar", "AITstar", "BITstar"} if BOOST_PYTHON else set())

# Planners for other spaces than those of a map.
_OTHER_SPACES = frozenset({"STRRTstar"})


def _wrap(wrapper: str, function: Callable[..., Any], home: Any = ob) -> Any:
    """Wrap a callback: Boost.Python wants a typed std::function, nanobind takes it as it is."""
    return getattr(home, wrapper)(function) if hasattr(home, wrapper) else function


def validity_function(function: Callable[[Any], bool]) -> Any:
    """Return what ``setStateValidityChecker`` takes for a Python function."""
    return _wrap("StateValidityCheckerFn", function)


def state_sampler_allocator(function: Callable[[Any], Any]) -> Any:
    """Return what ``StateSpace.setStateSamplerAllocator`` takes."""
    return _wrap("StateSamplerAllocator", function)


def valid_state_sampler_allocator(function: Callable[[Any], Any]) -> Any:
    """Return what ``SpaceInformation.setValidStateSamplerAllocator`` takes."""
    return _wrap("ValidStateSamplerAllocator", function)


def termination_condition(function: Callable[[], bool]) -> Any:
    """Return a planner termination condition that asks a Python function."""
    return ob.PlannerTerminationCondition(_wrap("PlannerTerminationConditionFn", function))


def new_benchmark(
    setup: Any,
    name: str,
    before_run: Callable[[Any], None],
    after_run: Callable[[Any, Any], None],
) -> Any:
    """Return an ``ompl.tools.Benchmark`` with its two events around each run."""
    benchmark = ot.Benchmark(setup, name)
    benchmark.setPreRunEvent(_wrap("PreSetupEvent", before_run, ot))
    benchmark.setPostRunEvent(_wrap("PostSetupEvent", after_run, ot))
    return benchmark


def benchmark_request() -> Any:
    """Return what ``Benchmark.benchmark`` takes: limits and options, as attributes to set."""
    return ot.Benchmark.Request() if BOOST_PYTHON else ot.Request()


def plane_space(low: NDArray[np.float64], high: NDArray[np.float64]) -> Any:
    """Return a two-dimensional RealVectorStateSpace.

    On OMPL 1.x the space of an SE2StateSpace is taken: one made by C++ needs no look-up of Python
    overrides at each distance, which more than doubles the iterations of RRT* per second.

    Args:
        low: lower bounds, shape (2,).
        high: upper bounds, shape (2,).
    """
    bounds = plane_bounds(low, high)
    if not BOOST_PYTHON:
        space = ob.RealVectorStateSpace(2)
        space.setBounds(bounds)
        return space
    owner = ob.SE2StateSpace()
    owner.setBounds(bounds)
    return owner.getSubspace(0)


def plane_bounds(low: Any, high: Any) -> Any:
    """Return bounds of positions; arguments as for :func:`plane_space`, or any sequences."""
    bounds = ob.RealVectorBounds(2)
    for axis in range(2):
        bounds.setLow(axis, float(low[axis]))
        bounds.setHigh(axis, float(high[axis]))
    return bounds


def make_pose_space(
    name: str,
    turning_radius: float | None,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> Any:
    """Return an SE2StateSpace, DubinsStateSpace or ReedsSheppStateSpace.

    Args:
        name: of the class.
        turning_radius: of the curves; None for SE2StateSpace.
        low: lower bounds of positions, shape (2,).
        high: upper bounds of positions, shape (2,).
    """
    kind = getattr(ob, name)
    space = kind() if turning_radius is None else kind(float(turning_radius))
    space.setBounds(plane_bounds(low, high))
    return space


def new_state(space: Any) -> Any:
    """Return a state of the space that lives as long as the returned object."""
    if BOOST_PYTHON:
        return ob.State(space)
    mistyped = []  # kept meanwhile, so that the next one lies elsewhere
    while not isinstance(state := space.allocState(), _state_class(space)):
        mistyped.append(state)
    return state


def _state_class(space: Any) -> Any:
    """Return the class of a space's states on nanobind; ``ob.State`` where it is not known."""
    if isinstance(space, ob.SE2StateSpace):
        return ob.SE2StateType
    if isinstance(space, ob.RealVectorStateSpace):
        return ob.RealVectorStateType
    return ob.CompoundState if isinstance(space, ob.CompoundStateSpace) else ob.State


def best_cost(planner: Any) -> float:
    """Return the cost of an RRT*-like planner's best solution, infinite before the first one."""
    return float(planner.bestCost().value())


def typed_state(state: Any) -> Any:
    """Return a state as callbacks see it.

    One made by :func:`new_state` must be kept alive meanwhile.
    """
    return state() if BOOST_PYTHON and isinstance(state, ob.State) and callable(state) else state


def start_states(planner: Any) -> list[Any]:
    """Return the start states of a planner that has begun to plan.

    On OMPL 2.0 they are read from the planner's tree: ``ProblemDefinition.getStartState`` hands
    out an owning pointer there, which is freed twice.
    """
    if BOOST_PYTHON:
        problem = planner.getProblemDefinition()
        return [problem.getStartState(i) for i in range(problem.getStartStateCount())]
    data = planner_data(planner)
    return [data.getStartVertex(i).getState() for i in range(data.numStartVertices())]


def valid_starts(
    problem: Any, si: Any, read: Callable[[Any], tuple[float, float]]
) -> list[tuple[float, float]]:
    """Return the positions of start states before a planner has begun to plan.

    On OMPL 2.0 they are those that a goal is asked about, which are valid: see
    :func:`start_states`. Without a validity checker there are none.

    Args:
        problem: an ``ob.ProblemDefinition`` with a goal.
        si: its space information.
        read: returns the position of a state.
    """
    if BOOST_PYTHON:
        return [read(problem.getStartState(i)) for i in range(problem.getStartStateCount())]
    if si.getStateValidityChecker() is None:
        return []
    goal, asked = problem.getGoal(), _AskedGoal(si, read)
    problem.setGoal(asked)
    try:
        problem.isTrivial()
    finally:
        problem.setGoal(goal)
    return asked.positions


class _AskedGoal(ob.GoalRegion):  # type: ignore[misc]
    """A goal that nothing is in, which notes what it is asked about."""

    def __init__(self, si: Any, read: Callable[[Any], tuple[float, float]]) -> None:
        super().__init__(si)
        self.positions: list[tuple[float, float]] = []
        self._read = read

    def distanceGoal(self, state: Any) -> float:  # noqa: N802
        self.positions.append(self._read(state))
        return 1.0e300


def clear_planner(planner: Any) -> None:
    """Clear a planner.

    One that was not set up has nothing to clear: PDST of ``ompl.control`` crashes then.
    """
    if not BOOST_PYTHON or planner.isSetup():
        planner.clear()


def clear_valid_state_sampler(si: Any) -> None:
    """Go back to OMPL's own valid-state sampler."""
    if BOOST_PYTHON:
        si.setValidStateSamplerAllocator(valid_state_sampler_allocator(ob.UniformValidStateSampler))
    else:
        si.clearValidStateSamplerAllocator()


def planner_data(planner: Any) -> Any:
    """Return the tree or roadmap of a planner as an ``ob.PlannerData``."""
    data = ob.PlannerData(planner.getSpaceInformation())
    planner.getPlannerData(data)
    return data


def is_exact(status: Any) -> bool:
    """Return whether a planner status is an exact solution.

    The truth value of a status counts approximate solutions as well.
    """
    return bool(status.getStatus() == ob.PlannerStatus.EXACT_SOLUTION)


def tree_edges(data: Any, read: Callable[[Any], tuple[float, float]]) -> NDArray[np.float64]:
    """Return the edges of an ``ob.PlannerData`` in the plane, (M, 2, 2).

    Args:
        data: from :func:`planner_data`.
        read: returns the (x, y) of a state.
    """
    count = data.numVertices()
    points = np.array([read(data.getVertex(i).getState()) for i in range(count)]).reshape(-1, 2)
    pairs = [(i, j) for i in range(count) for j in _edges_from(data, i)]
    return points[np.array(pairs, dtype=np.intp).reshape(-1, 2)]


def _edges_from(data: Any, vertex: int) -> list[int]:
    if not BOOST_PYTHON:
        return list(data.getEdges(vertex))
    targets = ou.vectorUint()
    data.getEdges(vertex, targets)
    return list(targets)


def planner_class(name: str) -> Any:
    """Return the class of a geometric planner by its OMPL name.

    Raises:
        PlannerError: this build has no such planner.
    """
    names = planner_names()
    if not (isinstance(name, str) and name in names):
        raise PlannerError(
            f"there is no planner {show(name)} to use on OMPL {ompl_version()}; there are "
            f"{', '.join(sorted(names))}"
        )
    return getattr(og, name)


def planner_names() -> frozenset[str]:
    """Return the names of the geometric planners of this build that can be used on a map.

    Left out are those that crash the interpreter by themselves, and STRRTstar, which plans in
    space-time only.
    """
    names = {
        name
        for name, value in vars(og).items()
        if isinstance(value, type) and issubclass(value, ob.Planner)
    }
    return frozenset(names - _BROKEN - _OTHER_SPACES)


def seed_ompl(seed: int) -> None:
    """Seed OMPL's generators that are made from now on.

    OMPL reports an error when it has sampled before, and reseeds all the same; the report
    is kept quiet.

    Args:
        seed: at least 0. OMPL knows no seed 0, so its own is ``seed % (2**32 - 1) + 1``.
    """
    with log_level(ou.LOG_NONE):
        ou.RNG.setSeed(seed % (2**32 - 1) + 1)
