"""Installing hooks: what makes a planner ask for samples of a heat map, and how it is undone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..sampling.sampler import HeatmapSampler
from . import compat, ompl_samplers
from .awaited import AwaitedHeatmap
from .compat import ou
from .goal_injection import InjectedGoal
from .goal_monitor import GoalMonitor
from .hooks import (
    BOUNDS_STEERING,
    GOAL_INJECTION,
    STATE_SAMPLER,
    VALID_STATE_SAMPLER,
    keeps_sampler,
)
from .monitor import PlannerMonitor, is_informed
from .states import StateAccess
from .steered_callbacks import install_steering
from .steering_monitor import SteeringMonitor
from .switching_samplers import (
    switching_state_sampler_allocator,
    switching_valid_state_sampler_allocator,
)


@dataclass(frozen=True)
class Wiring:
    """What the installation of a hook works with.

    Attributes:
        setup: a SimpleSetup with its planner, start and goal.
        planner: of the setup.
        name: of the planner.
        states: access to the positions of its states.
        source: the sampler of the heat map, or the heat map that is waited for.
        monitor: of the planner.
    """

    setup: Any
    planner: Any
    name: str
    states: StateAccess
    source: HeatmapSampler | AwaitedHeatmap
    monitor: PlannerMonitor


def install(hook: str, wiring: Wiring) -> Callable[[], None]:
    """Install a hook.

    Args:
        hook: the name of it.
        wiring: what it works with.

    Returns:
        What takes it out again.
    """
    return _INSTALL[hook](wiring)


def _use_state_sampler(wiring: Wiring) -> Callable[[], None]:
    space, planner, source = wiring.setup.getStateSpace(), wiring.planner, wiring.source
    space.setStateSamplerAllocator(
        switching_state_sampler_allocator(source, wiring.monitor)
        if isinstance(source, AwaitedHeatmap)
        else ompl_samplers.state_sampler_allocator(source)
    )
    restore = _reject_uninformed(planner) if is_informed(planner) else None
    keeps = keeps_sampler(wiring.name)
    if keeps:
        _renew_sampler(planner)

    def undo() -> None:
        space.clearStateSamplerAllocator()
        if restore is not None:
            restore()
        if keeps:
            _renew_sampler(planner)

    return undo


def _renew_sampler(planner: Any) -> None:
    """Set a planner up again, which says something of it on OMPL's log."""
    if planner.isSetup():
        with compat.log_level(ou.LOG_ERROR):
            planner.setup()


def _reject_uninformed(planner: Any) -> Callable[[], None]:
    """Let an informed planner reject samples: direct informed sampling makes its own sampler."""
    informed, rejection = planner.getInformedSampling(), planner.getSampleRejection()
    planner.setInformedSampling(False)
    planner.setSampleRejection(True)

    def restore() -> None:
        planner.setSampleRejection(False)
        planner.setInformedSampling(informed)
        planner.setSampleRejection(rejection)

    return restore


def _use_valid_state_sampler(wiring: Wiring) -> Callable[[], None]:
    si, source = wiring.setup.getSpaceInformation(), wiring.source
    si.setValidStateSamplerAllocator(
        switching_valid_state_sampler_allocator(source, wiring.monitor)
        if isinstance(source, AwaitedHeatmap)
        else ompl_samplers.valid_state_sampler_allocator(source)
    )
    return lambda: compat.clear_valid_state_sampler(si)


def _inject_goals(wiring: Wiring) -> Callable[[], None]:
    setup, planner = wiring.setup, wiring.planner
    original, bias = setup.getGoal(), planner.getGoalBias()
    si = setup.getSpaceInformation()
    assert isinstance(wiring.monitor, GoalMonitor)
    injected = InjectedGoal(si, original, wiring.states, wiring.source, wiring.monitor)
    setup.setGoal(injected)
    wiring.monitor.injected_goal = injected
    if not isinstance(wiring.source, AwaitedHeatmap):
        wiring.monitor.set_injected_fraction(1.0)

    def undo() -> None:
        if setup.getGoal() is injected:
            setup.setGoal(original)
        planner.setGoalBias(bias)

    return undo


def _steer_bounds(wiring: Wiring) -> Callable[[], None]:
    assert isinstance(wiring.monitor, SteeringMonitor)
    return install_steering(wiring.setup, wiring.states, wiring.source, wiring.monitor)


_INSTALL = {
    BOUNDS_STEERING: _steer_bounds,
    STATE_SAMPLER: _use_state_sampler,
    VALID_STATE_SAMPLER: _use_valid_state_sampler,
    GOAL_INJECTION: _inject_goals,
}
