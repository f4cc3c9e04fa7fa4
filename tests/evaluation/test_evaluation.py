from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.predictions import store
from helpers.training_set import TINY, write_training_set
from scipy.linalg import sqrtm

from cbagan_ompl import ConfigError, DatasetError
from cbagan_ompl.datasets.dataset import Dataset, Tasks, load_dataset
from cbagan_ompl.evaluation.baselines import stored_predictions, trivial_baselines
from cbagan_ompl.evaluation.bootstrap import RESAMPLES, interval, resampled_weights
from cbagan_ompl.evaluation.evaluator import Evaluator
from cbagan_ompl.evaluation.frechet import frechet_distance, region_features
from cbagan_ompl.evaluation.metrics import connects, task_scores


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_training_set(tmp_path_factory.mktemp("data") / "set", maps=4)


@pytest.fixture(scope="module")
def dataset(folder: Path) -> Dataset:
    return load_dataset(folder)


def evaluator(tasks: Tasks) -> Evaluator:
    return Evaluator(tasks, region_features, seed=0)


# --- scores ---------------------------------------------------------------------------------------


def test_the_truth_scores_one_and_the_background_nothing(dataset: Dataset) -> None:
    scorer, truth = evaluator(dataset.test), dataset.test.region.astype(bool)
    perfect = scorer.evaluate("truth", truth)
    assert perfect.scores["iou"] == perfect.scores["dice_per_image"] == 1
    assert perfect.frechet == pytest.approx(0, abs=1e-9)
    empty = scorer.evaluate("nothing", np.zeros_like(truth))
    for name in ("iou", "dice", "precision", "recall", "area", "connectivity"):
        assert empty.scores[name] == 0
    assert empty.frechet > 0.1


def test_8_and_4_connected() -> None:
    diagonal = np.eye(3, dtype=np.bool_)
    assert connects(diagonal, (0, 0), (2, 2), 8)
    assert not connects(diagonal, (0, 0), (2, 2), 4)
    ends = np.array([[0.5, 0.5]]), np.array([[2.5, 2.5]])
    tasks = task_scores(diagonal[None], diagonal[None], np.ones((1, 3, 3), bool), *ends)
    assert (tasks.joined.tolist(), tasks.joined_4.tolist()) == ([True], [False])
    assert tasks.means(np.ones(1))["area"] == pytest.approx(1 / 3)


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


# --- intervals ------------------------------------------------------------------------------------


def test_weights_of_resamples() -> None:
    map_of = np.repeat([3, 5, 9], [10, 10, 20])
    weights = resampled_weights(map_of, 0)
    assert weights.shape == (RESAMPLES, 40)
    assert np.array_equal(weights, resampled_weights(map_of, 0))
    # Each drawn map brings as many draws as it has tasks.
    for k in (3, 5, 9):
        assert not (weights[:, map_of == k].sum(axis=1) % (map_of == k).sum()).any()
    assert weights.mean() == pytest.approx(1, abs=0.05)


def test_tasks_of_one_map_do_not_count_as_independent() -> None:
    rng = np.random.default_rng(0)
    map_of = np.repeat(np.arange(10), 50)
    values = rng.normal(size=10)[map_of] + 0.1 * rng.normal(size=500)
    widths = []
    for groups in (map_of, np.arange(500)):
        weights = resampled_weights(groups, 0)
        low, high = interval(weights @ values / weights.sum(axis=1))
        assert low < values.mean() < high
        widths.append(high - low)
    assert widths[0] > 3 * widths[1]


# --- the Frechet distance -------------------------------------------------------------------------


def test_frechet_distance_against_the_matrix_root() -> None:
    rng = np.random.default_rng(0)
    one = rng.normal(size=(300, 6)) @ rng.normal(size=(6, 6)) + 1
    other = rng.normal(size=(200, 6)) @ rng.normal(size=(6, 6))
    first, second = np.cov(one, rowvar=False), np.cov(other, rowvar=False)
    shift = one.mean(axis=0) - other.mean(axis=0)
    expected = shift @ shift + np.trace(first + second - 2 * sqrtm(first @ second).real)
    assert frechet_distance(one, other) == pytest.approx(expected, rel=1e-9)
    assert frechet_distance(other, one) == pytest.approx(expected, rel=1e-9)


def test_frechet_distance_of_known_gaussians() -> None:
    base = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
    assert frechet_distance(base, base) == pytest.approx(0, abs=1e-12)
    assert frechet_distance(base, base + np.array([3, 4])) == pytest.approx(25)
    # Covariance c I against 4 c I in two dimensions: 2 (sqrt(4 c) - sqrt(c))^2 = 2 c.
    assert frechet_distance(base, 2 * base) == pytest.approx(2 * 2 / 3)


def test_frechet_distance_with_fewer_images_than_features() -> None:
    rng = np.random.default_rng(0)
    assert frechet_distance(rng.normal(size=(5, 40)), rng.normal(size=(6, 40))) > 0
    with pytest.raises(ConfigError, match="at least two"):
        frechet_distance(rng.normal(size=(1, 4)), rng.normal(size=(6, 4)))


def test_region_features_tell_parts_and_holes() -> None:
    ring = np.zeros((32, 32), dtype=np.bool_)
    ring[4:12, 4:12] = True
    ring[6:10, 6:10] = False
    two = np.zeros_like(ring)
    two[2:6, 2:6] = two[20:24, 20:24] = True
    features = region_features(np.stack((ring, two, np.zeros_like(ring))))
    assert features.shape == (3, 67)
    assert np.expm1(features[:, 65]).round().tolist() == [1, 2, 0]
    assert np.expm1(features[:, 66]).round().tolist() == [1, 0, 0]
    assert features[:, :64].sum(axis=1) * 16 == pytest.approx([48, 32, 0])


# --- stored predictions ---------------------------------------------------------------------------


@pytest.mark.parametrize("listed", [True, False])
def test_stored_predictions(folder: Path, dataset: Dataset, tmp_path: Path, listed: bool) -> None:
    store(tmp_path, folder, dataset.test.region, listed)
    regions = stored_predictions(tmp_path, folder, "test")
    assert np.array_equal(regions, dataset.test.region.astype(bool))


def test_faults_of_stored_predictions(folder: Path, dataset: Dataset, tmp_path: Path) -> None:
    store(tmp_path, folder, dataset.test.region, listed=True)
    (tmp_path / "roi_1.png").unlink()
    with pytest.raises(DatasetError, match=r"roi_1\.png"):
        stored_predictions(tmp_path, folder, "test")
    cv2.imwrite(str(tmp_path / "roi_1.png"), np.zeros((5, 5, 3), np.uint8))
    with pytest.raises(DatasetError, match="differs in size"):
        stored_predictions(tmp_path, folder, "test")
    (tmp_path / "results.csv").write_text("label\na\n")
    with pytest.raises(DatasetError, match="columns are true_roi, pred_roi"):
        stored_predictions(tmp_path, folder, "test")
    (tmp_path / "results.csv").write_text("true_roi,pred_roi\n")
    with pytest.raises(DatasetError, match="no prediction for map_0/"):
        stored_predictions(tmp_path, folder, "test")


def test_predictions_of_another_size_than_the_labels(dataset: Dataset) -> None:
    small = np.zeros((len(dataset.test), 16, 16), dtype=np.bool_)
    with pytest.raises(DatasetError, match="8 of 16 x 16 pixels, the labels 8 of 32 x 32"):
        evaluator(dataset.test).evaluate("small", small)
    with pytest.raises(DatasetError, match="7 of 32 x 32 pixels, the labels 8"):
        evaluator(dataset.test).evaluate("few", np.zeros((7, 32, 32), dtype=np.bool_))


# --- the command ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def model(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("torch")
    from cbagan_ompl.training.export import export
    from cbagan_ompl.training.loop import train
    from cbagan_ompl.training.task_sources import DatasetSource

    root = tmp_path_factory.mktemp("model")
    config = TINY.updated({"epochs": 1})
    source = DatasetSource(load_dataset(folder), config.validation_fraction, config.seed)
    run = train(source, config, root / "run", device="cpu", progress=False)
    export(run["checkpoint"], root / "tiny.pt")
    return root / "tiny.pt"


def run(*words: str) -> int:
    from cbagan_ompl.cli import main

    return main(["evaluate", *words])


def test_evaluate_command(
    model: Path,
    folder: Path,
    dataset: Dataset,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    stored = store(tmp_path / "stored", folder, dataset.test.region, listed=True)
    words = ["--dataset", str(folder), "--model", str(model), "--predictions", f"own={stored}"]
    assert run(*words, "--output", str(tmp_path / "out"), "--json", str(tmp_path / "s.json")) == 0
    table = capsys.readouterr().out
    assert "not FID" in table
    result = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    assert result == json.loads((tmp_path / "s.json").read_text())
    predictions = result["predictions"]
    assert list(predictions) == ["tiny", "own", "all free space", "straight line"]
    assert predictions["own"]["scores"]["iou"] == 1
    assert predictions["tiny"]["inference_ms"] > 0
    assert predictions["tiny"]["parameters"] > 0
    low, high = predictions["straight line"]["intervals"]["iou"]
    assert low <= predictions["straight line"]["scores"]["iou"] <= high
    for name in ("tiny", "own"):
        picture = cv2.imread(str(tmp_path / "out" / f"{name}.png"))
        assert min(picture.shape[:2]) > 500
    assert (
        f"| {predictions['tiny']['parameters']:,} |"
        in (tmp_path / "out" / "evaluation.md").read_text()
    )


def test_training_validates_as_the_command_scores(model: Path, dataset: Dataset) -> None:
    import torch

    from cbagan_ompl.inference.predictor import load_model
    from cbagan_ompl.training.checkpoints import best_generator, load_checkpoint
    from cbagan_ompl.training.validation import evaluate

    generator = best_generator(load_checkpoint(model.parent / "run" / "best.pt"))
    scores = evaluate(generator, dataset.test, torch.device("cpu"), 4)
    again = evaluator(dataset.test).evaluate_model("tiny", load_model(model)).scores
    assert scores == pytest.approx(dict(again))


def test_features_of_a_given_network(
    model: Path, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import torch

    class Colours(torch.nn.Module):
        def forward(self, images: torch.Tensor) -> torch.Tensor:
            assert images.shape[1:] == (3, 299, 299)
            return images.float().mean(dim=(2, 3))

    with pytest.warns(DeprecationWarning, match="torch.jit"):
        torch.jit.save(torch.jit.script(Colours()), str(tmp_path / "network.pt"))
    words = ["--dataset", str(folder), "--model", str(model)]
    assert run(*words, "--inception", str(tmp_path / "network.pt")) == 0
    assert "| FID |" in capsys.readouterr().out
    (tmp_path / "text.pt").write_text("text")
    assert run(*words, "--inception", str(tmp_path / "text.pt")) == 2
    assert "uint8 images (B, 3, 299, 299)" in capsys.readouterr().err


def test_bad_options(model: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--dataset", str(folder), "--model", str(model)]
    assert run(*words, "--predictions", "folder") == 2
    assert "NAME=DIR" in capsys.readouterr().err
    assert run(*words, "--model", str(model)) == 2
    assert "two predictions are called 'tiny'" in capsys.readouterr().err
    assert run(*words, "--predictions", f"straight line={folder}/tasks") == 2
    assert "two predictions are called 'straight line'" in capsys.readouterr().err
    for name in ("a/b", "a|b"):
        assert run(*words, "--predictions", f"{name}={folder}/tasks") == 2
        assert f"cannot be called {name!r}" in capsys.readouterr().err
    # Before the work is done, not after it.
    assert run(*words, "--output", str(folder / "test.csv" / "scores")) == 2
    output = capsys.readouterr()
    assert "cannot make the folder" in output.err
    assert not output.out
    assert run(*words, "--seed", "-1") == 2
