from __future__ import annotations

import hashlib
import json
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
from helpers.tiny_model import TINY

torch = pytest.importorskip("torch")

from cbagan_ompl import ConfigError, GridMap, ModelError
from cbagan_ompl.inference import model_files
from cbagan_ompl.inference.predictor import load_model
from cbagan_ompl.networks.export_model import RegionModel
from cbagan_ompl.training.cards import is_card, model_card
from cbagan_ompl.training.checkpoints import best_generator, load_checkpoint
from cbagan_ompl.training.export import export
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import DatasetSource

CONFIG = TINY.updated({"epochs": 1})


@pytest.fixture(scope="module")
def checkpoint(source: DatasetSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = train(source, CONFIG, tmp_path_factory.mktemp("run"), device="cpu", progress=False)
    return Path(run["checkpoint"])


@pytest.fixture(scope="module")
def exported(checkpoint: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("models") / "tiny.pt"
    export(checkpoint, path, note="Made by the tests.")
    return path


@pytest.mark.parametrize("size", [(64, 64), (37, 61), (1, 1)])
def test_eager_scripted_and_reloaded_agree(
    checkpoint: Path, exported: Path, size: tuple[int, int]
) -> None:
    eager = RegionModel(best_generator(load_checkpoint(checkpoint))).eval()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        models = (eager, torch.jit.script(eager), torch.jit.load(str(exported)))
    height, width = size
    free = (torch.rand(3, 1, height, width) > 0.3).float()
    start, goal = torch.rand(3, 2) * torch.tensor([width, height]), torch.zeros(3, 2)
    with torch.inference_mode():
        outputs = [model(free, start, goal) for model in models]
    assert outputs[0].shape == free.shape
    assert 0 <= outputs[0].min() <= outputs[0].max() <= 1
    for output in outputs[1:]:
        torch.testing.assert_close(output, outputs[0], rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    ("network", "words"),
    [
        ("cbagan", "convolutional block attention GAN"),
        ("sagan", "GAN with self-attention"),
        ("sa", "GAN with spatial attention"),
        ("none", "GAN with no attention"),
    ],
)
def test_the_card_names_the_network(exported: Path, network: str, words: str) -> None:
    record = model_files.read_record(exported)
    record["recipe"] = CONFIG.with_network(network).to_dict()
    assert words in model_card(record)


def test_record_card_and_manifest(exported: Path) -> None:
    record = model_files.read_record(exported)
    assert (record["name"], record["working_size"], record["schema"]) == ("tiny", 32, 1)
    assert record["recipe"] == CONFIG.to_dict()
    assert record["dataset"]["test_tasks"] == 4
    assert 0 <= record["metrics"]["test"]["iou"] <= 1
    card = exported.with_suffix(".md").read_text()
    assert "straight line" in card
    assert "Made by the tests." in card
    assert f"{record['parameters']:,}" in card
    manifest = json.loads((exported.parent / "manifest.json").read_text())
    assert manifest["default"] == "tiny.pt"
    assert (
        manifest["files"]["tiny.pt"]["sha256"] == hashlib.sha256(exported.read_bytes()).hexdigest()
    )


def test_a_second_export_keeps_the_default(checkpoint: Path, tmp_path: Path) -> None:
    for name in ("first.pt", "second.pt"):
        export(checkpoint, tmp_path / name)
    manifest = model_files.read_manifest(tmp_path / "manifest.json")
    assert (manifest["default"], len(manifest["files"])) == ("first.pt", 2)
    assert load_model(tmp_path / "second.pt").record["name"] == "second"


def test_an_exported_model_is_written_anew(exported: Path, tmp_path: Path) -> None:
    record = export(exported, tmp_path / "new.pt")
    before = model_files.read_record(exported)
    assert record == {**before, "name": "new", "date": record["date"]}
    grid, task = GridMap(np.ones((32, 32))), ((3, 4), (28, 20))
    old, new = (load_model(path).predict(grid, *task) for path in (exported, tmp_path / "new.pt"))
    np.testing.assert_allclose(new.values, old.values, atol=1e-4)


def test_export_of_what_is_no_checkpoint(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no such file"):
        export(tmp_path / "none.pt", tmp_path / "new.pt")


def test_export_to_where_nothing_can_be_written(checkpoint: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ModelError, match="cannot make the folder"):
        export(checkpoint, tmp_path / "file" / "model.pt")


def test_export_needs_the_suffix(checkpoint: Path, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"\.pt"):
        export(checkpoint, tmp_path / "model.txt")


@pytest.mark.parametrize("name", ["model.pt", "model.md", "manifest.json"])
def test_export_writes_over_nothing_of_others(checkpoint: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("# Of somebody else: cbagan-ompl, manifest.json\n")
    before = (tmp_path / name).read_bytes()
    with pytest.raises(ModelError, match=rf"{name} exists, and .* --force"):
        export(checkpoint, tmp_path / "model.pt")
    assert (tmp_path / name).read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == [name]
    export(checkpoint, tmp_path / "model.pt", force=True)
    assert load_model(tmp_path / "model.pt").record["name"] == "model"
    export(checkpoint, tmp_path / "model.pt")  # its own files it replaces


def test_export_never_writes_over_its_checkpoint(checkpoint: Path, tmp_path: Path) -> None:
    for name in ("best.pt", "model.md"):
        source = tmp_path / name
        shutil.copy(checkpoint, source)
        with pytest.raises(ConfigError, match="it is what the command reads"):
            export(source, source.with_suffix(".pt"), force=True)
        assert source.read_bytes() == checkpoint.read_bytes()


@pytest.mark.parametrize("stem", ["a" * 101, "a\nb", "a\udce9"])
def test_names_that_a_model_cannot_have(checkpoint: Path, tmp_path: Path, stem: str) -> None:
    with pytest.raises(ModelError, match="a model cannot be called"):
        export(checkpoint, tmp_path / f"{stem}.pt")


def test_cards_of_the_repository_are_known_as_cards() -> None:
    cards = sorted((Path(__file__).parents[2] / "models").glob("*.md"))
    assert cards
    assert all(map(is_card, cards))
