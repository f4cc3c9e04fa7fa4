from __future__ import annotations

import numpy as np
import pytest
from helpers.tiny_model import TINY

from cbagan_ompl.training.config import TrainingConfig
from cbagan_ompl.training.schedule import learning_rate_factor, plateau_factor


def test_learning_rates() -> None:
    cycle = [learning_rate_factor(TINY.updated({"epochs": 10}), step, 10) for step in range(100)]
    assert max(cycle) == cycle[10] == 1
    assert cycle[0] < 0.1
    assert cycle[-1] < 0.001
    paper = TrainingConfig.preset("paper")
    assert learning_rate_factor(paper, 9, 10) == 1
    assert learning_rate_factor(paper, 25, 10) == paper.decay**2


def test_plateau_lowers_the_learning_rates() -> None:
    config = TINY.updated({"plateau_patience": 2, "plateau_factor": 0.5})
    scores = [0.1, 0.3, 0.2, 0.3, 0.25, 0.4, 0.1, 0.1, 0.1]
    factors = [plateau_factor(config, scores[:n]) for n in range(len(scores) + 1)]
    assert factors == [1, 1, 1, 1, 1, 0.5, 0.5, 0.5, 0.5, 0.25]
    assert plateau_factor(TINY, [0.5] * 100) == 1


def test_plateau_is_pytorchs() -> None:
    torch = pytest.importorskip("torch")
    scores = np.random.default_rng(0).random(60).tolist()
    config = TINY.updated({"plateau_patience": 3, "plateau_factor": 0.5})
    optimizer = torch.optim.SGD([torch.zeros(1, requires_grad=True)], lr=1.0)
    schedule = torch.optim.lr_scheduler.ReduceLROnPlateau(
        optimizer, "max", factor=0.5, patience=3, threshold=0.0, eps=0.0
    )
    for n, score in enumerate(scores):
        schedule.step(score)
        assert plateau_factor(config, scores[: n + 1]) == optimizer.param_groups[0]["lr"]
