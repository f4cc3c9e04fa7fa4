from __future__ import annotations

import io
import json
import shutil
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.training_set import write_training_set

torch = pytest.importorskip("torch")

from cbagan_ompl import GridMap, Heatmap, ModelError, TaskError
from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.inference import model_files
from cbagan_ompl.inference.predictor import Predictor, load_model, scaled_free, scaled_shape
from cbagan_ompl.networks.export_model import RegionModel
from cbagan_ompl.training.checkpoints import best_generator, load_checkpoint
from cbagan_ompl.training.config import NETWORKS, TrainingConfig
from cbagan_ompl.training.export import export, model_card, save_script
from cbagan_ompl.training.gan import make_generator
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import DatasetSource

TINY = TrainingConfig(epochs=1, batch_size=4, widths=(4, 4, 6, 8), discriminator_width=4)


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    dataset = load_dataset(write_training_set(folder / "tiny"))
    source = DatasetSource(dataset, TINY.validation_fraction, TINY.seed)
    return Path(train(source, TINY, folder / "out", device="cpu", progress=False)["checkpoint"])


@pytest.fixture(scope="module")
def exported(checkpoint: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("models") / "tiny.pt"
    export(checkpoint, path, note="Made by the tests.")
    return path


@pytest.fixture
def model(exported: Path, tmp_path: Path) -> Path:
    """A copy without manifest, to damage."""
    return Path(shutil.copy(exported, tmp_path / "model.pt"))


# --- what is exported -----------------------------------------------------------------------------


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


@pytest.mark.parametrize("network", NETWORKS)
@pytest.mark.parametrize("size", [(64, 64), (40, 88)])
def test_every_network_agrees_when_exported(
    network: str, size: tuple[int, int], tmp_path: Path
) -> None:
    torch.manual_seed(0)
    generator = make_generator(TrainingConfig().with_network(network)).eval()
    for name, parameter in generator.named_parameters():
        if name.endswith("whole.factor"):
            torch.nn.init.constant_(parameter, 0.5)  # or self-attention would do nothing yet
    eager = RegionModel(generator).eval()
    save_script(eager, tmp_path / "model.pt", {})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        models = (torch.jit.script(eager), torch.jit.load(str(tmp_path / "model.pt")))
    free, ends = (torch.rand(1, 1, *size) > 0.3).float(), torch.rand(2, 1, 2) * 40
    with torch.inference_mode():
        expected = eager(free, ends[0], ends[1])
        for model in models:
            torch.testing.assert_close(model(free, ends[0], ends[1]), expected, rtol=0, atol=1e-5)


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
    record["recipe"] = TINY.with_network(network).to_dict()
    assert words in model_card(record)


def test_record_card_and_manifest(exported: Path) -> None:
    record = model_files.read_record(exported)
    assert (record["name"], record["working_size"], record["schema"]) == ("tiny", 32, 1)
    assert record["recipe"] == TINY.to_dict()
    assert record["dataset"]["test_tasks"] == 4
    assert 0 <= record["metrics"]["test"]["iou"] <= 1
    card = exported.with_suffix(".md").read_text()
    assert "straight line" in card
    assert "Made by the tests." in card
    assert f"{record['parameters']:,}" in card
    manifest = json.loads((exported.parent / "manifest.json").read_text())
    assert manifest["default"] == "tiny.pt"
    assert manifest["files"]["tiny.pt"]["sha256"] == model_files.sha256(exported)


def test_a_second_export_keeps_the_default(checkpoint: Path, tmp_path: Path) -> None:
    for name in ("first.pt", "second.pt"):
        export(checkpoint, tmp_path / name)
    manifest = model_files.read_manifest(tmp_path / "manifest.json")
    assert (manifest["default"], len(manifest["files"])) == ("first.pt", 2)
    assert load_model(tmp_path / "second.pt").record["name"] == "second"


def test_export_of_what_is_no_checkpoint(model: Path, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="an exported model, not a training checkpoint"):
        export(model, tmp_path / "new.pt")
    with pytest.raises(ModelError, match="no such file"):
        export(tmp_path / "none.pt", tmp_path / "new.pt")


def test_export_to_where_nothing_can_be_written(checkpoint: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ModelError, match="cannot write"):
        export(checkpoint, tmp_path / "file" / "model.pt")


def test_export_needs_the_suffix(checkpoint: Path, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"ends in \.pt"):
        export(checkpoint, tmp_path / "model.onnx")


# --- files that are no models ---------------------------------------------------------------------


def rewrite_record(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    source = io.BytesIO(path.read_bytes())
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name.endswith(model_files.RECORD_NAME):
                record = json.loads(content)
                change(record)
                content = json.dumps(record).encode()
            new.writestr(name, content)


def foreign_script(path: Path) -> None:
    save_script(torch.nn.Identity().eval(), path, {})
    source = io.BytesIO(path.read_bytes())
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if not name.endswith(model_files.RECORD_NAME):
                new.writestr(name, old.read(name))


def plain_zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/b.txt", "text")


def broken_record(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"model/extra/{model_files.RECORD_NAME}", "{")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: path.unlink(), "no such file"),
        (lambda path: (path.unlink(), path.mkdir()), "is a folder"),
        (lambda path: path.write_bytes(b""), "is empty"),
        (lambda path: path.write_text("weights: none\n"), "a text file"),
        (lambda path: path.write_bytes(bytes(range(256)) * 8), "not an exported model"),
        (lambda path: path.write_bytes(path.read_bytes()[:-4000]), "cut short"),
        (plain_zip, "a zip archive, but not"),
        (broken_record, "is damaged"),
        (lambda path: torch.save({"w": torch.ones(1)}, path), "run: cbagan-ompl export"),
        (foreign_script, "not one that `cbagan-ompl export` wrote"),
        (
            lambda path: rewrite_record(path, lambda record: record.update(schema=99)),
            "version 99.*install a newer",
        ),
        (
            lambda path: rewrite_record(path, lambda record: record.pop("working_size")),
            "lacks working_size",
        ),
        (
            lambda path: rewrite_record(path, lambda record: record.update(working_size=0)),
            "lacks working_size",
        ),
        (lambda path: rewrite_record(path, lambda record: record.pop("schema")), "lacks schema"),
        (lambda path: rewrite_record(path, lambda record: record.pop("name")), "lacks name"),
        (
            lambda path: rewrite_record(path, lambda record: record.update(parameters="many")),
            "lacks parameters",
        ),
        (
            lambda path: rewrite_record(path, lambda record: record.clear()),
            "lacks schema, working_size, name, parameters",
        ),
    ],
)
def test_bad_files_are_told_apart(
    model: Path, spoil: Callable[[Path], object], message: str
) -> None:
    spoil(model)
    with pytest.raises(ModelError, match=message) as caught:
        load_model(model)
    assert str(model) in str(caught.value)


def test_a_checkpoint_is_no_model(checkpoint: Path) -> None:
    with pytest.raises(ModelError, match="run: cbagan-ompl export"):
        load_model(checkpoint)


def test_damage_that_only_torch_sees(model: Path) -> None:
    source = io.BytesIO(model.read_bytes())
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(model, "w") as new:
        for name in old.namelist():
            if not name.endswith("data.pkl"):
                new.writestr(name, old.read(name))
    with pytest.raises(ModelError, match="torch cannot load the model"):
        load_model(model)


def test_the_manifest_guards_against_exchange(exported: Path, tmp_path: Path) -> None:
    for name in ("tiny.pt", "manifest.json"):
        shutil.copy(exported.parent / name, tmp_path)
    load_model(tmp_path / "tiny.pt")
    rewrite_record(tmp_path / "tiny.pt", lambda record: record.update(name="other"))
    with pytest.raises(ModelError, match="SHA-256 differs"):
        load_model(tmp_path / "tiny.pt")


@pytest.mark.parametrize("text", ["{", "[]", '{"default": "a.pt"}'])
def test_bad_manifest(tmp_path: Path, text: str) -> None:
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(ModelError, match="list of models"):
        model_files.read_manifest(tmp_path / "manifest.json")


def test_bundled_model_of_a_wheel_and_of_a_checkout(
    exported: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "cbagan_ompl"
    monkeypatch.setattr(model_files, "__file__", str(package / "network" / "model_files.py"))
    with pytest.raises(ModelError, match="no bundled model"):
        load_model()
    for folder in (tmp_path / "models", package / "models"):
        shutil.copytree(exported.parent, folder)
        assert model_files.bundled_model() == folder / "tiny.pt"
    assert load_model().record["name"] == "tiny"


# --- prediction -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def predictor(exported: Path) -> Predictor:
    return load_model(exported)


@pytest.mark.parametrize("shape", [(1, 2), (5, 3), (32, 32), (200, 31), (45, 130)])
def test_any_size(predictor: Predictor, shape: tuple[int, int]) -> None:
    free = np.ones(shape, bool)
    if min(shape) > 4:
        free[2:, 2] = False
    grid = GridMap(free, resolution=0.5, origin=(-1.0, 2.0, 0.3))
    ends = grid.to_world([(0.5, 0.5), (shape[1] - 0.5, shape[0] - 0.5)])
    heatmap = predictor.predict(grid, *ends, repair=False)
    assert isinstance(heatmap, Heatmap)
    assert heatmap.values.shape == shape
    assert (heatmap.values[free] > 0).all()
    assert (heatmap.values[~free] == 0).all()
    assert predictor.predict(grid, *ends).connects(*ends)


def test_predictions_repeat_and_leave_the_threads_alone(predictor: Predictor) -> None:
    grid, threads = GridMap(np.ones((32, 32))), torch.get_num_threads()
    first, second = (predictor.predict(grid, (1, 1), (30, 30)).values for _ in range(2))
    assert np.array_equal(first, second)
    assert torch.get_num_threads() == threads


def test_coordinates_of_the_network_are_pixels_of_the_scaled_map() -> None:
    seen: list[torch.Tensor] = []

    def module(free: torch.Tensor, start: torch.Tensor, goal: torch.Tensor) -> torch.Tensor:
        seen.extend((start, goal))
        return free * 0.75

    free = np.ones((40, 80), bool)
    free[:, 39:41] = False
    free[20] = True
    grid = GridMap(free, resolution=2.0)
    Predictor(module, {"working_size": 40}).predict(grid, (20, 10), (150, 70), repair=False)
    assert seen[0].tolist() == [[5, 2.5]]
    assert seen[1].tolist() == [[37.5, 17.5]]


def test_a_silent_network_still_gives_something_to_draw_from() -> None:
    predictor = Predictor(lambda free, start, goal: free * 0, {"working_size": 64})
    grid = GridMap(np.ones((20, 20)))
    heatmap = predictor.predict(grid, (1, 1), (18, 18), repair=False)
    assert heatmap.values.min() > 0
    assert not heatmap.region.any()


def test_bad_tasks_are_refused(predictor: Predictor) -> None:
    with pytest.raises(TaskError):
        predictor.predict(GridMap(np.ones((20, 20))), (1, 1), (50, 50))


def test_scaled_shape_keeps_the_aspect() -> None:
    assert scaled_shape((256, 128), 64) == (64, 32)
    assert scaled_shape((30, 40), 64) == (48, 64)
    assert scaled_shape((64, 20), 64) == (64, 20)
    assert scaled_shape((1000, 3), 64) == (64, 1)
    assert scaled_shape((20, 10), 64) == (40, 20), "doubled at most"


def test_scaling_keeps_narrow_passages() -> None:
    free = np.zeros((10, 7), bool)
    free[:, 3] = True
    assert scaled_free(free, (4, 3)).tolist() == [[False, True, False]] * 4
    assert np.array_equal(scaled_free(free, free.shape), free)


def test_small_maps_are_enlarged() -> None:
    free = np.array([[True, False], [False, True]])
    enlarged = scaled_free(free, (4, 6))
    assert np.array_equal(enlarged, free.repeat(2, axis=0).repeat(3, axis=1))
