from __future__ import annotations

import json
from dataclasses import replace
from multiprocessing import active_children

import numpy as np
import pytest
from helpers.synthetic import FEW, SMALL, threaded_source
from helpers.training_set import equal_tasks

from cbagan_ompl import ConfigError, DatasetError
from cbagan_ompl.datasets.synthetic import (
    TASKS_PER_MAP,
    SyntheticSettings,
    concatenate_tasks,
    generate_map_tasks,
)
from cbagan_ompl.training.task_sources import SyntheticSchedule, synthetic_source


@pytest.mark.parametrize("option", ["maps", "held_out", "jobs"])
def test_schedules_that_make_no_sense(option: str) -> None:
    with pytest.raises(ConfigError, match=f"{option} is a whole number of at least 1"):
        SyntheticSchedule(**{option: 0})


def test_processes_generate_what_the_seed_says() -> None:
    with synthetic_source(SMALL, FEW) as source:
        generated = source.epoch(0), source.validation, source.test
        assert source.size == 64
        assert source.description()["train_tasks"] == len(generated[0]) == 2 * TASKS_PER_MAP
    expected = concatenate_tasks([generate_map_tasks(SMALL, 0, n) for n in (0, 1)])
    assert equal_tasks(generated[0], expected)
    assert equal_tasks(generated[1], generate_map_tasks(SMALL, 1, 0))
    assert equal_tasks(generated[2], generate_map_tasks(SMALL, 2, 0))


def test_every_epoch_has_new_tasks_and_the_same_ones_again() -> None:
    with threaded_source() as source, threaded_source() as again:
        epochs = [source.epoch(n) for n in range(3)]
        # As a resumed run does.
        assert equal_tasks(again.epoch(2), epochs[2])
        assert equal_tasks(again.validation, source.validation)
    with threaded_source(replace(SMALL, seed=4)) as other:
        assert not equal_tasks(other.epoch(0), epochs[0])
    maps = [*epochs, source.validation, source.test]
    assert len(np.unique(np.concatenate([tasks.maps for tasks in maps]), axis=0)) == 8
    for tasks in epochs:
        assert tasks.map_of.tolist() == [0] * TASKS_PER_MAP + [1] * TASKS_PER_MAP


def test_the_description_of_a_source_can_be_written() -> None:
    with threaded_source() as source:
        description = source.description()
    assert json.loads(json.dumps(description)) == description
    assert (description["name"], description["maps"], description["side"]) == ("synthetic", 2, 64)
    assert description["test_tasks"] == TASKS_PER_MAP
    assert description["synthetic"]["seed"] == 3


def test_a_process_that_dies_gives_a_clear_error() -> None:
    settings = SyntheticSettings(size=64, generators=("blocks",))
    with synthetic_source(settings, SyntheticSchedule(maps=2, held_out=1)) as source:
        for child in active_children():
            child.kill()
        with pytest.raises(DatasetError, match="generates synthetic maps has died"):
            source.epoch(0)
