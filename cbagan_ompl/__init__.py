"""A learned state sampler for OMPL's planners on 2-D occupancy maps.

Data flows one way: map file -> :class:`GridMap` -> :class:`Predictor` -> :class:`Heatmap` ->
sampler -> OMPL's planner, unmodified -> path. See the README for a first example.

Every name is imported when it is first used: a heat map of one's own needs no torch, training needs
no ompl, and the command line starts at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .errors import (
    CbaganOmplError,
    CbaganOmplWarning,
    ClusterError,
    ConfigError,
    DatasetError,
    HeatmapError,
    MapError,
    MissingDependencyError,
    ModelError,
    PlannerError,
    RobotError,
    TaskError,
)
from .planning.exit_protection import protect_exit

if TYPE_CHECKING:
    from .inference.predictor import Predictor, load_model
    from .maps.grid_map import GridMap
    from .maps.loading import bundled_maps
    from .maps.tasks import Task, load_tasks, tasks_of
    from .planning.attach import Attachment, attach
    from .planning.hooks import reached_control_planners, reached_planners
    from .planning.ompl_samplers import (
        HeatmapStateSampler,
        HeatmapValidStateSampler,
        state_sampler_allocator,
        valid_state_sampler_allocator,
    )
    from .planning.plan import plan
    from .planning.plan_result import PlanResult
    from .planning.replanner import Replanner
    from .planning.robot_validity import RobotMotionValidator, RobotValidityChecker
    from .planning.validity import GridMotionValidator, GridValidityChecker
    from .plotting import save_figure
    from .robots.robot import Robot
    from .sampling.guarantee import Guarantee
    from .sampling.heatmap import Heatmap
    from .sampling.options import Adaptation, HeadingSpread, SamplerOptions

__version__ = "0.3.0"

__all__ = [
    "Adaptation",
    "Attachment",
    "CbaganOmplError",
    "CbaganOmplWarning",
    "ClusterError",
    "ConfigError",
    "DatasetError",
    "GridMap",
    "GridMotionValidator",
    "GridValidityChecker",
    "Guarantee",
    "HeadingSpread",
    "Heatmap",
    "HeatmapError",
    "HeatmapStateSampler",
    "HeatmapValidStateSampler",
    "MapError",
    "MissingDependencyError",
    "ModelError",
    "PlanResult",
    "PlannerError",
    "Predictor",
    "Replanner",
    "Robot",
    "RobotError",
    "RobotMotionValidator",
    "RobotValidityChecker",
    "SamplerOptions",
    "Task",
    "TaskError",
    "attach",
    "bundled_maps",
    "load_model",
    "load_tasks",
    "plan",
    "reached_control_planners",
    "reached_planners",
    "save_figure",
    "state_sampler_allocator",
    "tasks_of",
    "valid_state_sampler_allocator",
]

_HOMES = {
    "inference.predictor": ("Predictor", "load_model"),
    "maps.grid_map": ("GridMap",),
    "maps.loading": ("bundled_maps",),
    "maps.tasks": ("Task", "load_tasks", "tasks_of"),
    "planning.attach": ("Attachment", "attach"),
    "planning.hooks": ("reached_control_planners", "reached_planners"),
    "planning.plan": ("plan",),
    "planning.plan_result": ("PlanResult",),
    "planning.replanner": ("Replanner",),
    "planning.ompl_samplers": (
        "HeatmapStateSampler",
        "HeatmapValidStateSampler",
        "state_sampler_allocator",
        "valid_state_sampler_allocator",
    ),
    "planning.robot_validity": ("RobotMotionValidator", "RobotValidityChecker"),
    "planning.validity": ("GridMotionValidator", "GridValidityChecker"),
    "plotting": ("save_figure",),
    "robots.robot": ("Robot",),
    "sampling.guarantee": ("Guarantee",),
    "sampling.heatmap": ("Heatmap",),
    "sampling.options": ("Adaptation", "HeadingSpread", "SamplerOptions"),
}
protect_exit()

_LAZY = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_LAZY[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
