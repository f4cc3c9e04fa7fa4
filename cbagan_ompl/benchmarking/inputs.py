"""What a benchmark was run with and on, kept beside its results and compared when it goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import __version__
from ..common.files import read_bytes, read_text
from ..errors import ConfigError, HeatmapError, ModelError, show
from ..planning.heatmap_sources import AUTO, LEARNED
from .settings import Settings
from .tasks import BenchmarkTask, heatmap_path

# Largest record that is read: that of as many tasks as a benchmark may have.
_MAX_BYTES = 2**24

# Differences that a message names.
_SHOWN = 4

_MISSING = "nothing"


def record_inputs(tasks: Sequence[BenchmarkTask], settings: Settings) -> dict[str, Any]:
    """Return the settings, and what identifies versions, models, maps, tasks and heat maps.

    Args:
        tasks: the tasks of the benchmark.
        settings: what is compared on them.

    Returns:
        What ``settings.json`` holds: the flat keys of :meth:`.Settings.to_dict`, and
        ``ompl_version``, ``package_version``, ``model_hashes`` by sampler, ``maps`` by name, and
        ``tasks`` by name with their coordinates.

    Raises:
        ModelError: a model cannot be read.
        HeatmapError: a heat map cannot be read.
    """
    from ..planning.compat import ompl_version

    return {
        **settings.to_dict(),
        "package_version": __version__,
        "ompl_version": ompl_version(),
        "model_hashes": {
            sampler: _hash(read_bytes(path, ModelError))
            for sampler, path in sorted(model_files(settings).items())
        },
        "maps": {task.map_name: _describe_map(task) for task in tasks},
        "tasks": {task.name: _describe_task(task, settings) for task in tasks},
    }


def read_record(path: Path) -> dict[str, Any]:
    """Return what :func:`record_inputs` returned when a file was written.

    Raises:
        ConfigError: the file cannot be read, or does not hold such a record.
    """
    try:
        record = json.loads(read_text(path, ConfigError, _MAX_BYTES))
        if not isinstance(record, dict):
            raise ConfigError(f"it holds {show(record)}")
    except Exception as error:  # whatever the parser raises for odd texts
        raise ConfigError(
            f"{path} is damaged, so that nobody can tell what was compared here: choose another "
            f"folder, or delete this one ({error})"
        ) from error
    return record


def check_same(record: Mapping[str, Any], saved: Path) -> None:
    """Raise unless a file holds the same record; ``within`` may differ, it is of the report alone.

    Raises:
        ConfigError: it does not, or cannot be read; the message says what differs.
    """
    there, now = ({**of, "within": None} for of in (read_record(saved), record))
    differences = list(_differences(there, now))
    if differences:
        shown = "; ".join(differences[:_SHOWN])
        more = f"; and {len(differences) - _SHOWN} more" if len(differences) > _SHOWN else ""
        raise ConfigError(
            f"{saved.parent} holds a benchmark with other options, versions, maps or tasks, see "
            f"{saved.name}: {shown}{more}. Give the same ones, or choose another folder"
        )


def _differences(there: Any, now: Any, place: str = "") -> Iterator[str]:
    if isinstance(there, dict) and isinstance(now, dict) and (place == "" or (there and now)):
        for key in dict.fromkeys((*now, *there)):
            name = f"{place} {key}".strip()
            yield from _differences(there.get(key, _MISSING), now.get(key, _MISSING), name)
    elif there != now:
        yield f"{place} is {show(there)} there and {show(now)} now"


def model_files(settings: Settings) -> dict[str, Path]:
    """Return the file of the model of each sampler that has one, the bundled model included."""
    from ..inference.bundled_models import find_model

    models: dict[str, str | None] = dict(settings.models)
    if {LEARNED, AUTO} & settings.sources - set(models) - set(settings.heatmap_dirs):
        models[LEARNED] = None
    return {sampler: find_model(model) for sampler, model in models.items()}


def _describe_map(task: BenchmarkTask) -> dict[str, Any]:
    grid = task.workspace.source
    return {
        "width": grid.width,
        "height": grid.height,
        "resolution": grid.resolution,
        "origin": None if grid.origin is None else list(grid.origin),
        "hash": _hash(grid.cells),
    }


def _describe_task(task: BenchmarkTask, settings: Settings) -> dict[str, Any]:
    described: dict[str, Any] = {
        "start": [float(value) for value in task.task.start],
        "goal": [float(value) for value in task.task.goal],
        "optimal_cost": task.task.optimal_cost,
        "family": task.task.family,
    }
    if settings.heatmap_dirs:
        described["heatmap_hashes"] = {
            sampler: _hash(read_bytes(heatmap_path(folder, task), HeatmapError))
            for sampler, folder in settings.heatmap_dirs.items()
        }
    return described


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:32]
