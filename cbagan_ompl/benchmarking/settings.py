"""What a benchmark compares: one value for all tasks of it, kept beside their results."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

import yaml

from ..common.validation import check_at_least
from ..errors import ConfigError
from ..sampling.options import (
    ADAPTATION_RULES,
    DEFAULT_UNIFORM_FRACTION,
    Adaptation,
    SamplerOptions,
)

#: OMPL's own sampler, which the others are compared with.
BASELINE = "uniform"

#: The sampler of the bundled model, unless another one is given.
LEARNED = "learned"


@dataclass(frozen=True)
class Settings:
    """Options of a benchmark.

    Attributes:
        planners: OMPL's names.
        samplers: of :data:`cbagan_ompl.planning.plan.SAMPLERS`, and the keys of ``models`` and of
            ``heatmap_dirs``.
        runs: of each planner with each sampler on each task.
        time: limit of a run, seconds.
        range: longest edge of the planners that have this parameter, world units; by default
            OMPL's choice (a fifth of the map's diagonal).
        parameters: for some planners ``{parameter: value}``.
        uniform_fraction: share of draws that stays uniform over free space, in (0, 1].
        adaptation: names of the parts of the adaptation that are on, see
            :mod:`cbagan_ompl.sampling.adaptation`.
        sharpness: power of the heat maps that draws follow; by default what suits each planner,
            see :func:`cbagan_ompl.attach`.
        models: for some samplers the file of the model that they draw from; the bundled one for
            ``learned`` by default.
        heatmap_dirs: for some samplers the folder of their heat maps, one for each task.
        radius: of the robot, world units.
        seed: at least 0.

    Raises:
        ConfigError: an option that makes no sense.
    """

    planners: tuple[str, ...] = ("RRT", "RRTstar", "InformedRRTstar")
    samplers: tuple[str, ...] = (BASELINE, LEARNED, "corridor")
    runs: int = 5
    time: float = 0.4
    range: float | None = None
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    uniform_fraction: float = DEFAULT_UNIFORM_FRACTION
    adaptation: tuple[str, ...] = ADAPTATION_RULES
    sharpness: float | None = None
    models: Mapping[str, str] = field(default_factory=dict)
    heatmap_dirs: Mapping[str, str] = field(default_factory=dict)
    radius: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for what, names in (("planners", self.planners), ("samplers", self.samplers)):
            if not names or len(set(names)) < len(names):
                raise ConfigError(f"{what} must be named, and each once, got {', '.join(names)!r}")
        check_at_least("runs", self.runs, 1)
        for name, value in (("time", self.time), ("range", self.range)):
            if value is not None and not (isfinite(value) and value > 0):
                raise ConfigError(f"{name} must be above 0, got {value}")
        check_at_least("seed", self.seed, 0)
        self.sampler_options(self.seed)
        for planner in self.parameters:
            if planner not in self.planners:
                raise ConfigError(
                    f"a parameter of {planner} is set, which is not among the planners "
                    f"{', '.join(self.planners)}"
                )

    def sampler_options(self, seed: int) -> SamplerOptions:
        """Return how samples follow the heat maps."""
        return SamplerOptions(
            self.uniform_fraction, self.sharpness, Adaptation.of(self.adaptation), seed
        )

    def save(self, path: Path) -> None:
        """Write the settings as JSON."""
        path.write_text(json.dumps(asdict(self), indent=2) + "\n", encoding="utf-8")

    def is_saved_in(self, path: Path) -> bool:
        """Whether a file that :meth:`save` wrote holds the same settings."""
        saved = json.loads(path.read_text(encoding="utf-8"))
        return bool(saved == json.loads(json.dumps(asdict(self))))


def parse_parameters(assignments: list[str]) -> dict[str, dict[str, Any]]:
    """Parameters of planners from texts such as ``RRTstar.rewire_factor=1.2``.

    Raises:
        ConfigError: a text of another form.
    """
    parameters: dict[str, dict[str, Any]] = {}
    for assignment in assignments:
        key, equals, text = assignment.partition("=")
        planner, dot, name = key.partition(".")
        if not (planner and dot and name and equals):
            raise ConfigError(f"expected PLANNER.parameter=value, got {assignment!r}")
        parameters.setdefault(planner, {})[name] = yaml.safe_load(text)
    return parameters
