"""Prediction: an exported model, applied to maps of any size."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager
from os import PathLike
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.memory import is_out_of_memory, translate_lack_of_memory
from ..common.validation import truth_value, whole_number
from ..errors import ModelError, TaskError, show
from ..maps.checks import check_grid
from ..maps.grid_map import GridMap
from ..maps.grid_search import prepare_search
from ..networks.config import MAX_IMAGE_SIZE
from ..robots.poses import passable_map, position_map, position_of
from ..robots.robot import Robot
from ..sampling.bridges import connect
from ..sampling.guarantee import Guarantee
from ..sampling.heatmap import Heatmap
from ..sampling.robot_heatmaps import on_positions
from .bundled_models import find_model
from .choice import make_pipeline
from .graphs import TorchGraphs
from .model_files import read_model
from .model_loading import RUNTIMES, load_functions, prepare_runtime
from .onnx_graphs import OnnxGraphs
from .pipelines import KeptMaps, Painting
from .scaling import scaled_map, scaled_shape

if TYPE_CHECKING:
    import torch

# Values below this become 0: by the labels that networks are trained on, paths through such pixels
# are a quarter longer than the best. What a network paints far from any path is a thousandth or so;
# on large maps that would add up to most of the samples, and cost time in every pixel.
_LEAST_VALUE = 2.0**-5

# Of free space where the network paints nothing at all, so that the heat map can be sampled.
_FLOOR = 1e-4

# Side of the patches in which directions are painted, in pixels.
_PATCH = 4

# Tasks in one pass of the network: more are no quicker, and take memory.
_BATCH = 8


def load_model(path: str | PathLike[str] | None = None) -> Predictor:
    """Load an exported model, ready to predict.

    TorchScript files can carry code, so load only files from a source that you trust. Damage is
    found before it does harm: archive, record and the length of each tensor are checked before
    torch opens the file, and a model that no ``manifest.json`` beside it lists (``export`` writes
    one) is tried in another process first, which takes a second, once for each content.

    Args:
        path: a file that ``cbagan-ompl export`` wrote, TorchScript (``.pt``, for torch) or ONNX
            (``.onnx``, for ONNX Runtime); or the name of a model that comes with the package, such
            as ``cbagan``, that of the paper; the default model without it.

    Raises:
        MissingDependencyError: torch, or ONNX Runtime, is not installed.
        ModelError: the file is missing, no exported model, damaged, or of a newer version.

    Example:
        >>> load_model()
        Predictor('cbagan-worlds', working size 256 pixels)
        >>> load_model("cbagan")
        Predictor('cbagan', working size 64 pixels)
    """
    source = find_model(path)
    model = read_model(source)  # before torch is loaded, which takes seconds
    prepare_runtime(source, model)
    try:
        predictor = Predictor(load_functions(model), model.record)
        predictor.warm_up()
        prepare_search(with_costs=True)  # for regions that have to be connected
    except ModelError as error:
        is_damaged = error.__cause__ is None or not is_out_of_memory(error.__cause__)
        hint = "; copy or export it again" if is_damaged else ""
        raise ModelError(f"{source}: {error}{hint}") from error
    except Exception as error:  # torch raises many types for damaged archives
        if is_out_of_memory(error):
            raise ModelError(f"{source}: not enough memory to load the model") from error
        raise ModelError(
            f"{source}: {RUNTIMES[model.format]} cannot load the model ({type(error).__name__}), "
            "the file is probably damaged; copy or export it again"
        ) from error
    return predictor


class Predictor:
    """An exported model, ready to predict.

    Attributes:
        module: the TorchScript module, or the ONNX graphs.
        record: what the model file says about itself: ``working_size``, ``metrics``, ``recipe``...
        guarantee: what is known of the regions that the model predicts, with repair, for maps like
            those that it was calibrated on; None where it was not. Every such heat map has it.
        inference_threads: CPU threads for one prediction. More than one rarely helps at the
            working size, and takes ten times as long where other work has the cores.

    Args:
        module: maps (free, start, goal) to a region probability, see
            :class:`cbagan_ompl.networks.export_model.RegionModel`; or ONNX graphs.
        record: the record of its file.

    Raises:
        ModelError: the module cannot be called, or the record is none.
        ConfigError: the ``working_size`` of the record makes no sense.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> heatmap = load_model().predict(GridMap.load("bundled:rooms"), (20, 20), (230, 230))
        >>> heatmap.values.shape
        (256, 256)
    """

    def __init__(self, module: torch.nn.Module | OnnxGraphs, record: dict[str, Any]) -> None:
        is_model = isinstance(module, OnnxGraphs) or callable(module)
        if not is_model or not isinstance(record, dict):
            raise ModelError(
                f"a Predictor takes a module and its record, got {show(module)} and "
                f"{show(record)}; load_model makes one from a file"
            )
        whole_number("working_size", record.get("working_size", 0), 1, MAX_IMAGE_SIZE)
        self.module: Any = module
        self.record = record
        self.guarantee = Guarantee.from_record(record)
        self.inference_threads = 1
        self._graphs = module if isinstance(module, OnnxGraphs) else TorchGraphs(module)
        self._pipeline = make_pipeline(self._graphs)
        self._kept: WeakKeyDictionary[GridMap, KeptMaps] = WeakKeyDictionary()

    def warm_up(self) -> None:
        """Predict for an empty map, since the first call takes up to four times as long.

        Raises:
            ModelError: the output is no image of probabilities.
        """
        size = int(self.record["working_size"])
        endpoints = np.array([[0.5, 0.5], [size - 0.5, size - 0.5]])
        free = np.ones((1, size, size), np.bool_)
        values = self.probabilities(free, endpoints[:1], endpoints[1:])
        if values.shape != free.shape or not ((values >= 0) & (values <= 1)).all():
            raise ModelError("the model gives no image of probabilities, it is probably damaged")

    def predict(
        self,
        grid: GridMap,
        start: ArrayLike,
        goal: ArrayLike,
        repair: bool = True,
        robot: Robot | None = None,
    ) -> Heatmap:
        """Predict where good paths probably run.

        Args:
            grid: the map, of any size. For the network its longer side is scaled to the model's
                ``working_size`` (small maps to twice their size), and the result back again.
            start: (x, y), world, or a pose for a robot with heading.
            goal: the same.
            repair: connect the parts of the region where it does not connect start and goal, see
                :meth:`Heatmap.connected`; without it the heat map is the network's output.
            robot: what moves; the heat map lies on the map of its positions. None for a point.

        Raises:
            RobotError: ``robot`` is no robot.
            MapError: ``grid`` is no :class:`GridMap`.
            TaskError: see :meth:`GridMap.check_task`.
            ConfigError: ``repair`` is no truth value.
        """
        return self.predict_many(grid, [start], [goal], repair, robot)[0]

    def predict_many(
        self,
        grid: GridMap,
        starts: Iterable[ArrayLike],
        goals: Iterable[ArrayLike],
        repair: bool = True,
        robot: Robot | None = None,
    ) -> list[Heatmap]:
        """Predict for several tasks on one map, in passes of several tasks each.

        Args:
            grid: the map.
            starts: (x, y) of each task, world, or poses for a robot with heading.
            goals: the same.
            repair: see :meth:`predict`.
            robot: see there.

        Returns:
            The heat map of each task.

        Raises:
            MapError: ``grid`` is no :class:`GridMap`.
            RobotError: ``robot`` is no robot.
            TaskError: starts and goals are not as many, or see :meth:`GridMap.check_task`.
            ConfigError: ``repair`` is no truth value.

        Example:
            >>> from cbagan_ompl import GridMap
            >>> grid = GridMap.load("bundled:rooms")
            >>> goals = [(230, 230), (230, 20)]
            >>> len(load_model().predict_many(grid, [(20, 20)] * 2, goals))
            2
        """
        check_grid(grid)
        starts, goals = _list_points("starts", starts), _list_points("goals", goals)
        if len(starts) != len(goals):
            raise TaskError(f"each task has a start and a goal, got {len(starts)} and {len(goals)}")
        maps = [grid] * len(starts)
        if robot is not None:
            starts = [position_of(robot, "start", start) for start in starts]
            goals = [position_of(robot, "goal", goal) for goal in goals]
            maps = [passable_map(grid, robot, *task) for task in zip(starts, goals, strict=True)]
            grid = position_map(grid, robot)
        heatmaps: dict[int, Heatmap] = {}
        for one in dict.fromkeys(maps):
            tasks = [task for task, its_map in enumerate(maps) if its_map is one]
            for first in range(0, len(tasks), _BATCH):
                batch = tasks[first : first + _BATCH]
                ends = [starts[task] for task in batch], [goals[task] for task in batch]
                heatmaps.update(zip(batch, self._predict(one, *ends, repair), strict=True))
        return [on_positions(heatmaps[task], grid) for task in range(len(maps))]

    def _predict(
        self, grid: GridMap, starts: list[ArrayLike], goals: list[ArrayLike], repair: bool
    ) -> list[Heatmap]:
        """Predict for tasks on one map, in one pass of the network."""
        repair = truth_value("repair", repair)
        tasks = [grid.check_task(*task) for task in zip(starts, goals, strict=True)]
        shape = scaled_shape(grid.shape, int(self.record["working_size"]))
        scale = shape[1] / grid.width, shape[0] / grid.height
        pixels = grid.to_pixel(np.array(tasks))
        maps, endpoints = self._read_grid(grid, shape), pixels * scale
        painting = self._run(maps, endpoints[:, 0], endpoints[:, 1])
        heatmaps = [_make_heatmap(painting, i, grid) for i in range(len(tasks))]
        if not repair:
            return heatmaps
        heatmaps = [connect(heatmap, pair) for heatmap, pair in zip(heatmaps, pixels, strict=True)]
        for heatmap in heatmaps:
            heatmap.guarantee = self.guarantee
        return heatmaps

    def probabilities(
        self, free: NDArray[np.bool_], start: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Return the network's output for maps at the size they have, without scaling or repair.

        Args:
            free: (B, H, W), true where free.
            start: (B, 2), pixel coordinates (u, v), u right and v down.
            goal: (B, 2), the same.

        Returns:
            (B, H, W), the probability that a pixel belongs to the region.

        Raises:
            ModelError: there is not enough memory.
        """
        return self._run(self._read_maps(free), start, goal).region

    def _read_grid(self, grid: GridMap, shape: tuple[int, int]) -> KeptMaps:
        """Return a map at a size as the network has read it; a second task does not pay for it."""
        kept = self._kept.get(grid)
        if kept is None or kept.shape != shape:
            full = None if shape == grid.shape else grid.free
            kept = self._kept[grid] = self._read_maps(scaled_map(grid, shape)[None], full)
        return kept

    def _read_maps(
        self, free: NDArray[np.bool_], full: NDArray[np.bool_] | None = None
    ) -> KeptMaps:
        with _translate_lack_of_memory(free.shape), self._graphs.ready():
            return self._pipeline.read_maps(free, full)

    def _run(
        self, maps: KeptMaps, start: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> Painting:
        """Return what the network paints for tasks on maps."""
        self._graphs.threads = self.inference_threads
        shape = len(start), *maps.shape
        with _translate_lack_of_memory(shape), self._graphs.ready():
            return self._pipeline.paint(maps, start.astype(np.float32), goal.astype(np.float32))

    def __repr__(self) -> str:
        return (
            f"Predictor({self.record.get('name')!r}, "
            f"working size {self.record['working_size']} pixels)"
        )


def _translate_lack_of_memory(shape: tuple[int, ...]) -> AbstractContextManager[None]:
    return translate_lack_of_memory(
        ModelError,
        f"to predict for maps of shape {shape}",
        "give it fewer at a time, or take a model with a smaller working size",
    )


def _list_points(name: str, points: Iterable[ArrayLike]) -> list[ArrayLike]:
    """Return the endpoints of several tasks as a list."""
    try:
        return list(points)
    except Exception as error:  # a number, or whatever the class raises
        raise TaskError(f"{name} is a list of points (x, y), got {show(points)}") from error


def _make_heatmap(painting: Painting, task: int, grid: GridMap) -> Heatmap:
    """Return the heat map of one of the tasks that a network has painted."""
    from ..sampling.painting import paint_heatmap  # here, since numba takes long to import

    height, width = painting.region.shape[1:]
    directions = None if painting.directions is None else painting.directions[task]
    patches = height / _PATCH, width / _PATCH
    heatmap = paint_heatmap(painting.region[task], grid, _LEAST_VALUE, directions, patches)
    return heatmap or Heatmap(np.full(grid.shape, _FLOOR, np.float32), grid)
