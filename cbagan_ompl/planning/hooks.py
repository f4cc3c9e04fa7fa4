"""Which planner samples from what, and so by which hook a heat map reaches it on this build."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ..errors import PlannerError, show
from .compat import BINDINGS, HAS_STATE_SAMPLER_ALLOCATOR, ompl_version, planner_names
from .planner_kinds import CONTROL_PREFIX

#: The planner asks a StateSampler of its space.
STATE_SAMPLER = "state-sampler"
#: The planner asks a ValidStateSampler of its space information.
VALID_STATE_SAMPLER = "valid-state-sampler"
#: The planner samples its goal with a probability that can be set, and grows its tree towards the
#: sample. It asks the goal about each new node as well, so that samples can follow the tree.
GOAL_INJECTION = "goal-injection"
#: The planner samples between bounds of its space that callbacks can set for each sample.
BOUNDS_STEERING = "bounds-steering"


@dataclass(frozen=True)
class PlannerTraits:
    """What has to be known of a planner.

    Attributes:
        hook: what it samples from: :data:`STATE_SAMPLER`, :data:`VALID_STATE_SAMPLER` or
            :data:`GOAL_INJECTION`; None for a planner that nothing reaches.
        without_allocator: the hook on builds where no StateSampler can be set.
        stops_at_first: whether its solve ends with the first path.
        is_greedy: whether its trees grow in a few long strides, so that a narrow region serves it.
        keeps_sampler: whether it makes its sampler when it is set up and keeps it from then on.
        samples_are_nodes: whether its samples become the nodes of a roadmap, where they are valid.
        hangs_with: the bindings, see :data:`.compat.BINDINGS`, with which a solve never returns
            when its termination condition is a Python function; None for no bindings.
        hangs_at_optimum: whether a solve never returns once it has a path as short as the straight
            line.
        counts_iterations: whether it tells how many iterations it has done, in each of which it
            adds one node at most.
        asks_in_thread: whether it asks its goal from a thread of its own, which hangs or crashes
            where the goal is written in Python.
        needs_directed_controls: whether its samples are where controls lead to, and nothing else.
            OMPL's default is to try a single control, so that they make no difference.
        samples_at_once: whether it makes all its samples when its solve begins.
    """

    hook: str | None
    without_allocator: str | None = None
    stops_at_first: bool = False
    is_greedy: bool = False
    keeps_sampler: bool = False
    samples_are_nodes: bool = False
    hangs_with: str | None = None
    hangs_at_optimum: bool = False
    counts_iterations: bool = False
    asks_in_thread: bool = False
    needs_directed_controls: bool = False
    samples_at_once: bool = False


_ROADMAP: dict[str, Any] = {
    "hook": VALID_STATE_SAMPLER,
    "samples_are_nodes": True,
    "asks_in_thread": True,
}

#: Every geometric planner that some hook reaches on some build, by OMPL's name of its class.
PLANNERS = {
    "BFMT": PlannerTraits(STATE_SAMPLER, stops_at_first=True, samples_at_once=True),
    "BKPIECE1": PlannerTraits(VALID_STATE_SAMPLER, stops_at_first=True),
    "BiEST": PlannerTraits(VALID_STATE_SAMPLER, stops_at_first=True),
    "EST": PlannerTraits(VALID_STATE_SAMPLER, stops_at_first=True),
    "FMT": PlannerTraits(STATE_SAMPLER, stops_at_first=True, samples_at_once=True),
    "InformedRRTstar": PlannerTraits(GOAL_INJECTION, counts_iterations=True),
    "KPIECE1": PlannerTraits(STATE_SAMPLER, stops_at_first=True),
    "LBKPIECE1": PlannerTraits(STATE_SAMPLER, stops_at_first=True),
    "LBTRRT": PlannerTraits(STATE_SAMPLER),
    "LazyPRM": PlannerTraits(
        STATE_SAMPLER, stops_at_first=True, keeps_sampler=True, samples_are_nodes=True
    ),
    "LazyPRMstar": PlannerTraits(STATE_SAMPLER, keeps_sampler=True, samples_are_nodes=True),
    "LazyRRT": PlannerTraits(STATE_SAMPLER, stops_at_first=True),
    "PDST": PlannerTraits(STATE_SAMPLER, stops_at_first=True),
    "PRM": PlannerTraits(
        VALID_STATE_SAMPLER,
        stops_at_first=True,
        samples_are_nodes=True,
        hangs_with="nanobind",
        asks_in_thread=True,
    ),
    "PRMstar": PlannerTraits(**_ROADMAP, hangs_with="nanobind"),
    "ProjEST": PlannerTraits(VALID_STATE_SAMPLER, stops_at_first=True),
    "RRT": PlannerTraits(GOAL_INJECTION, stops_at_first=True),
    "RRTConnect": PlannerTraits(
        STATE_SAMPLER, without_allocator=BOUNDS_STEERING, stops_at_first=True, is_greedy=True
    ),
    "RRTXstatic": PlannerTraits(STATE_SAMPLER, counts_iterations=True),
    "RRTsharp": PlannerTraits(STATE_SAMPLER, counts_iterations=True),
    "RRTstar": PlannerTraits(GOAL_INJECTION, counts_iterations=True),
    "SBL": PlannerTraits(VALID_STATE_SAMPLER, stops_at_first=True),
    "SORRTstar": PlannerTraits(GOAL_INJECTION, hangs_at_optimum=True, counts_iterations=True),
    "SPARS": PlannerTraits(**_ROADMAP, hangs_with="boost"),
    "SPARStwo": PlannerTraits(**_ROADMAP, hangs_with="boost"),
    "SST": PlannerTraits(STATE_SAMPLER),
    "STRIDE": PlannerTraits(VALID_STATE_SAMPLER, stops_at_first=True),
    "TRRT": PlannerTraits(STATE_SAMPLER, stops_at_first=True),
}

#: The same of ``ompl.control``.
CONTROL_PLANNERS = {
    "control.EST": PlannerTraits(
        VALID_STATE_SAMPLER, stops_at_first=True, needs_directed_controls=True
    ),
    "control.PDST": PlannerTraits(STATE_SAMPLER, stops_at_first=True, needs_directed_controls=True),
    "control.RRT": PlannerTraits(GOAL_INJECTION, stops_at_first=True),
    "control.SST": PlannerTraits(STATE_SAMPLER),
}

_UNREACHED = PlannerTraits(None)


def hook_of(planner: str) -> str:
    """Return the name of the hook that reaches a planner on the installed OMPL.

    Args:
        planner: OMPL's name of its class, such as ``"RRTstar"`` or ``"control.RRT"``.

    Raises:
        PlannerError: no hook of this build reaches it; the message says what would.
    """
    traits = _traits_of(planner)
    is_control = planner.startswith(CONTROL_PREFIX)
    reached = _list_reached(reached_control_planners() if is_control else reached_planners())
    if traits.hook is None:
        reason = "it samples controls alone" if is_control else "its samplers are made inside OMPL"
        raise PlannerError(f"no hook reaches {planner}: {reason}; {reached}")
    hook = _available_hook(traits)
    if hook is None:
        raise PlannerError(
            f"{planner} samples from a StateSampler, which OMPL {ompl_version()} does not let "
            "Python set: it needs a build that binds StateSpace.setStateSamplerAllocator, such "
            f"as ompl 1.7.0; {reached}"
        )
    return hook


def reached_planners() -> dict[str, str]:
    """Return the planners of the installed OMPL that a hook reaches, each with the hook's name.

    These are the geometric ones, see :func:`reached_control_planners` for others.

    Example:
        >>> reached_planners()["RRTstar"]
        'goal-injection'
    """
    hooks = {name: _available_hook(PLANNERS[name]) for name in planner_names() & PLANNERS.keys()}
    return {name: hook for name, hook in sorted(hooks.items()) if hook is not None}


def reached_control_planners() -> dict[str, str]:
    """Return the planners of ``ompl.control`` that a hook reaches, each with the hook's name.

    Example:
        >>> reached_control_planners()["control.RRT"]
        'goal-injection'
    """
    hooks = {name: _available_hook(traits) for name, traits in CONTROL_PLANNERS.items()}
    return {name: hook for name, hook in hooks.items() if hook is not None}


def check_planner(planner: str, *, follows_heatmap: bool) -> None:
    """Raise if a planner cannot be used.

    Args:
        planner: OMPL's name of it.
        follows_heatmap: whether it is to sample a heat map, and so must be reached by a hook.

    Raises:
        PlannerError: this build has no such planner, or no hook reaches it; the message lists those
            that can be used.
    """
    names = planner_names()
    if not (isinstance(planner, str) and planner in names):
        have = (
            _list_reached(reached_planners())
            if follows_heatmap
            else f"there are {', '.join(sorted(names))}"
        )
        raise PlannerError(
            f"there is no planner {show(planner)} to use on OMPL {ompl_version()}; {have}"
        )
    if follows_heatmap:
        hook_of(planner)


def describe_planners() -> list[str]:
    """Return what can be planned with on the installed OMPL, as sentences for a help text."""
    reached = reached_planners()
    others = sorted(planner_names() - reached.keys())
    return [
        f"Planners that sample heat maps on OMPL {ompl_version()}: {', '.join(reached)}.",
        f"With the uniform sampler also: {', '.join(others)}.",
        'Other spellings, such as "RRT*" and rrt-connect, are understood.',
    ]


def stops_at_first(planner: str) -> bool:
    """Return whether the solve of a planner ends with its first path."""
    return _traits_of(planner).stops_at_first


def wants_sharp(planner: str) -> bool:
    """Return whether a planner is served best by a heat map that is raised to a power."""
    traits = _traits_of(planner)
    return not traits.stops_at_first or traits.is_greedy


def keeps_sampler(planner: str) -> bool:
    """Return whether a planner makes its sampler when it is set up and keeps it from then on."""
    return _traits_of(planner).keeps_sampler


def samples_are_nodes(planner: str) -> bool:
    """Return whether the samples of a planner become the nodes of a roadmap."""
    return _traits_of(planner).samples_are_nodes


def hangs_on_python_termination(planner: str) -> bool:
    """Return whether a solve with a termination condition in Python never returns."""
    return _traits_of(planner).hangs_with == BINDINGS


def hangs_at_optimum(planner: str) -> bool:
    """Return whether a solve never returns once it has a path as short as the straight line."""
    return _traits_of(planner).hangs_at_optimum


def counts_iterations(planner: str) -> bool:
    """Return whether a planner counts its iterations, each of which adds a node at most."""
    return planner in PLANNERS and PLANNERS[planner].counts_iterations


def asks_in_thread(planner: str) -> bool:
    """Return whether a planner asks its goal from a thread of its own."""
    return _traits_of(planner).asks_in_thread


def needs_directed_controls(planner: str) -> bool:
    """Return whether samples matter to a planner only where several controls are tried."""
    return _traits_of(planner).needs_directed_controls


def check_switchable(planner: str) -> None:
    """Raise if a planner cannot begin to sample a heat map in the middle of a solve.

    Args:
        planner: OMPL's name of it, one that a hook reaches.

    Raises:
        PlannerError: it makes all its samples at the beginning.
    """
    if _traits_of(planner).samples_at_once:
        raise PlannerError(
            f"{planner} makes all its samples when its solve begins, so that a heat map that comes "
            "later is of no use to it: wait for the heat map, without overlap"
        )


def _traits_of(planner: str) -> PlannerTraits:
    return PLANNERS.get(planner) or CONTROL_PLANNERS.get(planner) or _UNREACHED


def _available_hook(traits: PlannerTraits) -> str | None:
    if traits.hook == STATE_SAMPLER and not HAS_STATE_SAMPLER_ALLOCATOR:
        return traits.without_allocator
    return traits.hook


def _list_reached(planners: Iterable[str]) -> str:
    return f"heat maps reach {', '.join(planners)}"
