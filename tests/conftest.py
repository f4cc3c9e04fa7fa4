from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

# Before torch is loaded: on small tensors several threads mostly wait for each other, and on a
# busy machine for minutes.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pytest
from helpers.benchmarks import Finished, run_benchmark_of_walls, write_map
from helpers.tasks import GOAL, START

from cbagan_ompl import GridMap, Heatmap


@pytest.fixture(scope="session")
def two_walls() -> GridMap:
    """256 x 256, two walls with one gap each, on opposite sides."""
    free = np.ones((256, 256), bool)
    free[60:70, :200] = False
    free[150:160, 50:] = False
    return GridMap(free, name="two_walls")


@pytest.fixture(scope="session")
def corridor(two_walls: GridMap) -> Heatmap:
    return Heatmap.corridor(two_walls, START, GOAL)


@pytest.fixture(scope="session")
def map_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("maps")
    write_map(folder)
    return folder


@pytest.fixture(scope="session")
def finished(map_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Finished:
    return run_benchmark_of_walls(map_folder, tmp_path_factory.mktemp("benchmark") / "out")


@pytest.fixture
def interruptible() -> Iterator[None]:
    """A process that was started in the background ignores SIGINT, and so do its children.

    An interrupt while coverage notes a file would leave its lock taken, for ever: it pauses.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    measured = measured_coverage()
    if measured is not None:
        measured.stop()
    yield
    if measured is not None:
        measured.start()
    signal.signal(signal.SIGINT, before)


def measured_coverage() -> Any:
    """Return the coverage that is measured in this process, if any."""
    module = sys.modules.get("coverage")
    return None if module is None else module.Coverage.current()
