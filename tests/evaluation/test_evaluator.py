from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.tiny_model import export_tiny_model

from cbagan_ompl import DatasetError
from cbagan_ompl.datasets.dataset import Dataset, Tasks
from cbagan_ompl.evaluation.baselines import trivial_baselines
from cbagan_ompl.evaluation.evaluator import Evaluator
from cbagan_ompl.evaluation.frechet import region_features
from cbagan_ompl.evaluation.metrics import task_scores


def evaluator(tasks: Tasks) -> Evaluator:
    return Evaluator(tasks, region_features, seed=0)


def test_the_truth_scores_one_and_the_background_nothing(dataset: Dataset) -> None:
    scorer, truth = evaluator(dataset.test), dataset.test.region.astype(bool)
    perfect = scorer.evaluate("truth", truth)
    assert perfect.scores["iou"] == perfect.scores["dice_per_image"] == 1
    assert perfect.frechet == pytest.approx(0, abs=1e-9)
    empty = scorer.evaluate("nothing", np.zeros_like(truth))
    for name in ("iou", "dice", "precision", "recall", "area", "connectivity"):
        assert empty.scores[name] == 0
    assert empty.frechet > 0.1


def test_weights_count_tasks(dataset: Dataset) -> None:
    tasks = dataset.test
    predicted = trivial_baselines(tasks)["straight line"]
    scored = evaluator(tasks).evaluate("line", predicted).tasks
    weights = np.zeros(len(tasks))
    weights[[0, 2]] = 2, 1
    twice = [0, 0, 2]
    truth = tasks.region.astype(bool)
    expected = task_scores(
        predicted[twice], truth[twice], tasks.free[twice], tasks.start[twice], tasks.goal[twice]
    ).means(np.ones(3))
    for name, value in scored.means(weights).items():
        assert float(value) == pytest.approx(float(expected[name])), name


def test_predictions_of_another_size_than_the_labels(dataset: Dataset) -> None:
    small = np.zeros((len(dataset.test), 16, 16), dtype=np.bool_)
    with pytest.raises(DatasetError, match="8 of 16 x 16 pixels, the labels 8 of 32 x 32"):
        evaluator(dataset.test).evaluate("small", small)
    with pytest.raises(DatasetError, match="7 of 32 x 32 pixels, the labels 8"):
        evaluator(dataset.test).evaluate("few", np.zeros((7, 32, 32), dtype=np.bool_))


def test_training_validates_as_the_command_scores(
    folder: Path, dataset: Dataset, tmp_path: Path
) -> None:
    torch = pytest.importorskip("torch")

    from cbagan_ompl.inference.predictor import load_model
    from cbagan_ompl.training.checkpoints import best_generator, load_checkpoint
    from cbagan_ompl.training.validation import evaluate

    model = export_tiny_model(folder, tmp_path)
    generator = best_generator(load_checkpoint(model.parent / "run" / "best.pt"))
    scores = evaluate(generator, dataset.test, torch.device("cpu"), 4)
    again = evaluator(dataset.test).evaluate_model("tiny", load_model(model)).scores
    assert scores == pytest.approx(dict(again))
