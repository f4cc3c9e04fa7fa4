"""Which planner draws from what, and so by which hook a heat map reaches it on this build."""

from __future__ import annotations

from ..errors import PlannerError
from .compat import HAS_STATE_SAMPLER_ALLOCATOR, ompl_version, planner_names

STATE_SAMPLER = "state-sampler"
VALID_STATE_SAMPLER = "valid-state-sampler"
GOAL_INJECTION = "goal-injection"

# Planners that make their sampler when they are set up, and keep it for good.
KEEP_SAMPLER = frozenset({"LazyPRM", "LazyPRMstar"})

# Planners that draw from a StateSampler of the space, but for those that sample their goal as well.
_DRAW_STATES = KEEP_SAMPLER | {
    "BFMT",
    "FMT",
    "KPIECE1",
    "LBKPIECE1",
    "LBTRRT",
    "LazyRRT",
    "PDST",
    "RRTConnect",
    "RRTXstatic",
    "RRTsharp",
    "SST",
    "TRRT",
}

# Planners that draw from a ValidStateSampler of the space information.
_DRAW_VALID_STATES = frozenset(
    {
        "BKPIECE1",
        "BiEST",
        "EST",
        "PRM",
        "PRMstar",
        "ProjEST",
        "SBL",
        "SPARS",
        "SPARStwo",
        "STRIDE",
    }
)

# Planners that grow their tree towards samples of the goal with a settable probability. They ask
# the goal about every node of their tree as well, so that draws can follow what the tree does.
_SAMPLE_GOAL = frozenset({"InformedRRTstar", "RRT", "RRTstar", "SORRTstar"})

#: Planners whose solve ends with the first solution.
STOP_AT_FIRST = frozenset(
    {
        "BFMT",
        "BKPIECE1",
        "BiEST",
        "EST",
        "FMT",
        "KPIECE1",
        "LBKPIECE1",
        "LazyPRM",
        "LazyRRT",
        "PDST",
        "PRM",
        "ProjEST",
        "RRT",
        "RRTConnect",
        "SBL",
        "STRIDE",
        "TRRT",
    }
)


def hook_of(planner: str) -> str:
    """Name of the hook that reaches a planner on the installed OMPL.

    Args:
        planner: OMPL's name of its class, such as ``"RRTstar"``.

    Raises:
        PlannerError: no hook of this build reaches it; the message says what would.
    """
    if planner in _DRAW_VALID_STATES:
        return VALID_STATE_SAMPLER
    if planner in _SAMPLE_GOAL:
        return GOAL_INJECTION
    if planner in _DRAW_STATES and HAS_STATE_SAMPLER_ALLOCATOR:
        return STATE_SAMPLER
    if planner in _DRAW_STATES:
        raise PlannerError(
            f"{planner} draws from a StateSampler, which OMPL {ompl_version()} does not let "
            "Python set: it needs a build that binds StateSpace.setStateSamplerAllocator, such "
            f"as ompl 1.7.0. {_reached()}"
        )
    raise PlannerError(
        f"no hook reaches {planner}: its samplers are made inside OMPL. {_reached()}"
    )


def reached_planners() -> dict[str, str]:
    """The planners of the installed OMPL that a hook reaches, each with the hook's name."""
    reachable = _DRAW_VALID_STATES | _SAMPLE_GOAL
    if HAS_STATE_SAMPLER_ALLOCATOR:
        reachable |= _DRAW_STATES
    return {name: hook_of(name) for name in sorted(reachable & planner_names())}


def _reached() -> str:
    return f"Reached here: {', '.join(reached_planners())}"
