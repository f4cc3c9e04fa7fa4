"""What a benchmark compares: one value for all tasks of it, saved beside their results."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from ..common.validation import is_finite_number, positive_number, whole_number
from ..common.yaml_text import parse_yaml
from ..errors import ConfigError, show
from ..planning.heatmap_sources import LEARNED, UNIFORM
from ..planning.planner_names import planner_name
from ..robots.robot import Robot
from ..sampling.options import SamplerOptions
from .sampler_variants import SamplerVariant, parse_sampler

#: OMPL's own sampler, which the others are compared with.
BASELINE = UNIFORM

#: By default a path is good once its cost is within so many percent of the best known one.
DEFAULT_WITHIN = 5

#: Most runs of all planners on one task, whose log is kept in memory at the end; longest time
#: limit, a day in seconds; largest threshold of a good path, percent.
MAX_RUNS, MAX_TIME, MAX_WITHIN = 5000, 86400, 10_000


@dataclass(frozen=True)
class Settings:
    """Options of a benchmark.

    Attributes:
        planners: by OMPL's names; other spellings, such as ``RRT*``, are replaced by those.
        samplers: of :data:`cbagan_ompl.planning.heatmap_sources.SAMPLERS`, and the keys of
            ``models`` and of ``heatmap_dirs``; each may change options, as in
            ``"learned:adaptation=none"``, see :func:`.parse_sampler`.
        runs: number of runs of each planner with each sampler on each task.
        time: time limit of a run, seconds.
        range: longest edge of the planners that have this parameter, world units; by default
            OMPL's choice (a fifth of the map's diagonal).
        parameters: for some planners ``{parameter: value}``.
        sampler_options: how samples follow the heat maps; its seed, an int of at least 0, is also
            that of OMPL and of random tasks.
        models: for some samplers the file of the model that makes their heat maps; the bundled one
            for ``learned`` by default.
        heatmap_dirs: for some samplers the folder of their heat maps, one for each task.
        robot: what moves.
        simplify: planners whose paths OMPL's path simplifier shortens after each run; its time
            counts in the time to a good path.
        within: threshold of a good path, in percent above the best known cost: reports and plots
            show the time until a run gets there.

    Raises:
        ConfigError: an option that makes no sense.

    Example:
        >>> settings = Settings(planners=("RRTstar",), samplers=("uniform", "corridor"), runs=3)
        >>> settings.to_dict()["adaptation"]
        ['connectivity', 'coverage', 'stagnation']
    """

    planners: tuple[str, ...] = ("RRT", "RRTstar", "InformedRRTstar")
    samplers: tuple[str, ...] = (BASELINE, LEARNED, "corridor")
    runs: int = 5
    time: float = 0.4
    range: float | None = None
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    sampler_options: SamplerOptions = field(default_factory=lambda: SamplerOptions(seed=0))
    models: Mapping[str, str] = field(default_factory=dict)
    heatmap_dirs: Mapping[str, str] = field(default_factory=dict)
    robot: Robot = field(default_factory=Robot.point)
    simplify: tuple[str, ...] = ()
    within: int = DEFAULT_WITHIN

    def __post_init__(self) -> None:
        self._spell_planners()
        for what, names in (("planners", self.planners), ("samplers", self.samplers)):
            if not names or len(set(names)) < len(names):
                raise ConfigError(f"{what} must be named, and each once, got {show(list(names))}")
        self.variants()
        whole_number("runs", self.runs, 1)
        variants = len(self.planners) * len(self.samplers)
        if self.runs * variants > MAX_RUNS:
            raise ConfigError(
                f"{show(self.runs)} runs of {variants} planners with samplers are more than the "
                f"{MAX_RUNS} that a task may have: do fewer runs, on more tasks"
            )
        if positive_number("time", self.time) > MAX_TIME:
            raise ConfigError(f"time is at most {MAX_TIME} s, got {show(self.time)}")
        if self.range is not None:
            positive_number("range", self.range)
        seed = self.sampler_options.seed
        if not isinstance(seed, int):
            raise ConfigError(f"the seed of a benchmark must be an int, got {show(seed)}")
        whole_number("seed", seed, 0)
        whole_number("within", self.within, 1, MAX_WITHIN)
        for what, named in (("set", self.parameters), ("simplify", self.simplify)):
            for planner in named:
                if planner not in self.planners:
                    raise ConfigError(
                        f"{what} names {show(planner)}, which is not among the planners "
                        f"{', '.join(self.planners)}"
                    )

    def _spell_planners(self) -> None:
        for option in ("planners", "simplify"):
            names = tuple(planner_name(name) for name in getattr(self, option))
            object.__setattr__(self, option, names)
        parameters = {planner_name(name): values for name, values in self.parameters.items()}
        object.__setattr__(self, "parameters", parameters)

    def variants(self) -> list[SamplerVariant]:
        """Return the samplers, parsed."""
        return [parse_sampler(name) for name in self.samplers]

    @property
    def sources(self) -> set[str]:
        """The sources of the samplers' heat maps: their names without options."""
        return {variant.source for variant in self.variants()}

    @property
    def seed(self) -> int:
        """The seed of OMPL, of the samples and of random tasks."""
        assert isinstance(self.sampler_options.seed, int), "checked above"
        return self.sampler_options.seed

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as they are saved, JSON-ready; the sampler options lie flat in them.

        The adaptation is the list of the names of its rules that are on.
        """
        saved: dict[str, Any] = {}
        for name in (entry.name for entry in fields(self)):
            if name == "sampler_options":
                saved["uniform_fraction"] = self.sampler_options.uniform_fraction
                saved["adaptation"] = list(self.sampler_options.adaptation.names)
                saved["sharpness"] = self.sampler_options.sharpness
                saved["seed"] = self.seed
                saved["heading"] = asdict(self.sampler_options.heading)
            elif name == "robot":
                saved[name] = asdict(self.robot)
            else:
                saved[name] = getattr(self, name)
        return json.loads(json.dumps(saved))  # type: ignore[no-any-return]


def parse_parameters(assignments: list[str]) -> dict[str, dict[str, Any]]:
    """Return parameters of planners from texts such as ``RRTstar.rewire_factor=1.2``.

    Raises:
        ConfigError: a text of another form.

    Example:
        >>> parse_parameters(["RRTstar.rewire_factor=1.2"])
        {'RRTstar': {'rewire_factor': 1.2}}
    """
    parameters: dict[str, dict[str, Any]] = {}
    for assignment in assignments:
        key, equals, text = assignment.partition("=")
        planner, dot, name = key.partition(".")
        if not (planner and dot and name and equals):
            raise ConfigError(f"expected PLANNER.parameter=value, got {show(assignment)}")
        value = parse_yaml(text, f"--set {show(key)}", ConfigError)
        if not isinstance(value, bool | str) and not is_finite_number(value):
            raise ConfigError(
                f"--set {show(key)}: the value is a finite number, true, false or a word, got "
                f"{show(value)}"
            )
        parameters.setdefault(planner_name(planner), {})[name] = value
    return parameters
