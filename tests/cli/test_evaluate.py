from __future__ import annotations

import json
from pathlib import Path

import cv2
import pytest
from helpers.damaged_archives import damaged_members
from helpers.predictions import store
from helpers.tiny_model import export_tiny_model
from helpers.training_set import write_training_set

from cbagan_ompl.cli import main
from cbagan_ompl.datasets.dataset import Dataset, load_dataset


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_training_set(tmp_path_factory.mktemp("data") / "set", maps=4)


@pytest.fixture(scope="module")
def dataset(folder: Path) -> Dataset:
    return load_dataset(folder)


@pytest.fixture(scope="module")
def model(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_tiny_model(folder, tmp_path_factory.mktemp("model"))


def run(*words: str) -> int:
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
    report = json.loads((tmp_path / "s.json").read_text())
    assert report["made_by"].startswith("cbagan-ompl ")
    assert result == report
    predictions = result["predictions"]
    assert list(predictions) == ["tiny", "own", "all free space", "straight line"]
    assert predictions["own"]["scores"]["iou"] == 1
    assert predictions["tiny"]["inference_ms"] > 0
    assert predictions["tiny"]["parameters"] > 0
    low, high = predictions["straight line"]["intervals"]["iou"]
    assert low <= predictions["straight line"]["scores"]["iou"] <= high
    for name in ("tiny", "own"):
        image = cv2.imread(str(tmp_path / "out" / f"{name}.png"))
        assert min(image.shape[:2]) > 500
    assert (
        f"| {predictions['tiny']['parameters']:,} |"
        in (tmp_path / "out" / "evaluation.md").read_text()
    )


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
    assert run(*words, "--predictions", f"stored={folder}/none") == 2
    assert "no such folder of predictions; a copy that `dataset" in capsys.readouterr().err
    # Before the work is done, not after it.
    assert run(*words, "--output", str(folder / "test.csv" / "scores")) == 2
    output = capsys.readouterr()
    assert "cannot make the folder" in output.err
    assert not output.out
    assert run(*words, "--seed", "-1") == 2


def test_names_with_signs_that_mean_something_elsewhere(
    model: Path, folder: Path, dataset: Dataset, tmp_path: Path
) -> None:
    stored = store(tmp_path / "stored", folder, dataset.test.region, listed=True)
    words = ["--dataset", str(folder), "--model", str(model), "--output", str(tmp_path / "out")]
    assert run(*words, "--predictions", f"$x^{{_=\\{stored}") == 2
    assert run(*words, "--predictions", f"$x^{{_={stored}") == 0
    assert (tmp_path / "out" / "$x^{_.png").exists()


@pytest.mark.parametrize("name", ["a\nb", "a\0b", "x" * 300, "a\udce9", "a\\b", "\x1b[31m"])
def test_names_that_cannot_be_files_or_rows(
    model: Path, folder: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--dataset", str(folder), "--model", str(model)]
    assert run(*words, "--predictions", f"{name}={folder}/tasks") == 2
    said = capsys.readouterr().err
    assert len(said) < 1000
    assert said.isascii()


def test_files_of_others_are_kept(
    model: Path,
    folder: Path,
    dataset: Dataset,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    stored = store(tmp_path / "stored", folder, dataset.test.region, listed=True)
    words = ["--dataset", str(folder), "--model", str(model), "--predictions", f"own={stored}"]
    out = tmp_path / "out"
    out.mkdir()
    for name in ("evaluation.md", "evaluation.json", "tiny.png"):
        (out / name).write_text("of somebody else")
        assert run(*words, "--output", str(out)) == 2
        assert "--force" in capsys.readouterr().err
        assert (out / name).read_text() == "of somebody else"
        (out / name).unlink()
    for source in (folder, stored):
        assert run(*words, "--output", str(source), "--force") == 2
        assert "it is what the command reads" in capsys.readouterr().err
    (out / "evaluation.md").write_text("of somebody else")
    assert run(*words, "--output", str(out), "--force") == 0
    assert run(*words, "--output", str(out)) == 0, "its own files it replaces"


@pytest.mark.slow
def test_damaged_inception_networks(
    model: Path, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    valid = model.read_bytes()
    path = tmp_path / "network.pt"
    words = ["--dataset", str(folder), "--model", str(model), "--inception", str(path)]
    for data in (valid, valid[:-100], *damaged_members(valid, 4, seed=1)):
        path.write_bytes(data)
        assert run(*words) == 2
        assert "uint8 images (B, 3, 299, 299)" in capsys.readouterr().err
