from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")

from helpers.damaged_archives import damaged_members
from helpers.damaged_models import load_in_one_process
from helpers.fuzzing import mutations, read_all

from cbagan_ompl import GridMap, MissingDependencyError, ModelError, Predictor, load_model
from cbagan_ompl.inference.bundled_models import find_model
from cbagan_ompl.inference.model_files import read_model, read_record
from cbagan_ompl.inference.onnx_graphs import OnnxGraphs
from cbagan_ompl.training.export import export
from cbagan_ompl.training.model_weights import recover_generator


@pytest.fixture(scope="module")
def onnx_file(checkpoint: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("models") / "tiny.onnx"
    export(checkpoint, path)
    return path


@pytest.fixture
def unlisted(onnx_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy that no manifest lists, and that has not been tried."""
    monkeypatch.setenv("CBAGAN_OMPL_TRIED_MODELS", "")
    return Path(shutil.copy(onnx_file, tmp_path / "copy.onnx"))


def assert_same_heatmaps(one: Predictor, other: Predictor, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    free = rng.random(shape) < 0.9
    free[1], free[:, 1] = True, True
    grid = GridMap(free)
    starts = [(0.5 + x, 1.5) for x in range(11)]
    goals = [(1.5, shape[0] - 0.5 - y) for y in range(11)]
    for repair in (True, False):
        pairs = zip(
            one.predict_many(grid, starts, goals, repair),
            other.predict_many(grid, starts, goals, repair),
            strict=True,
        )
        for heatmap, expected in pairs:
            np.testing.assert_allclose(heatmap.values, expected.values, rtol=0, atol=1e-4)


@pytest.mark.parametrize("shape", [(32, 32), (20, 70), (150, 61)])
def test_both_formats_predict_the_same(
    onnx_file: Path, exported: Path, shape: tuple[int, int]
) -> None:
    assert_same_heatmaps(load_model(onnx_file), load_model(exported), shape)


@pytest.mark.parametrize("shape", [(256, 256), (300, 130)])
def test_the_bundled_model_predicts_the_same(shape: tuple[int, int]) -> None:
    path = find_model(None)
    assert path.suffix == ".pt"
    other = load_model(path.with_suffix(".onnx"))
    assert isinstance(other.module, OnnxGraphs)
    assert other.guarantee == load_model(path).guarantee
    assert_same_heatmaps(other, load_model(path), shape)


def test_the_record_is_the_same(onnx_file: Path, exported: Path) -> None:
    assert read_record(onnx_file) == read_record(exported) | {"note": ""}
    assert read_model(onnx_file).is_listed
    assert "this model" in onnx_file.with_suffix(".md").read_text()


def test_the_card_of_both_formats_is_kept(onnx_file: Path, exported: Path, tmp_path: Path) -> None:
    export(exported, tmp_path / "both.pt")
    card = tmp_path / "both.md"
    card.write_text(card.read_text() + "\nWritten by hand.\n")
    export(exported, tmp_path / "both.onnx")
    assert card.read_text().endswith("Written by hand.\n")


WITHOUT_TORCH = """
import sys
sys.modules["torch"] = None
from cbagan_ompl import GridMap, load_model, plan
grid = GridMap.load("bundled:rooms")
for path in (sys.argv[1], None, "cbagan-worlds"):
    model = load_model(path)
    assert model.predict(grid, (20, 20), (230, 230)).connects((20, 20), (230, 230))
model.inference_threads = 2
assert model.predict(grid, (20, 20), (230, 230)).region.any()
assert plan(grid, (20, 20), (230, 230), planner="RRT", time=5, seed=1).solved
assert plan(grid, (20, 20), (230, 230), planner="RRT", sampler="auto", time=5, seed=1).solved
"""


def test_torch_is_not_needed(unlisted: Path, tmp_path: Path) -> None:
    """Nor are temporary files: newer versions of ONNX Runtime keep one for what they send."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_TORCH, str(unlisted)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "TMPDIR": str(temporary)},
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert list(temporary.iterdir()) == []


def test_without_onnx_runtime_the_message_says_what_to_install(
    onnx_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(MissingDependencyError, match=r"pip install -e '.\[onnx\]'"):
        load_model(onnx_file)


def test_a_replaced_file_is_refused(onnx_file: Path, tmp_path: Path) -> None:
    shutil.copytree(onnx_file.parent, tmp_path / "models")
    path = tmp_path / "models" / "tiny.onnx"
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(ModelError, match="SHA-256 differs"):
        load_model(path)


def replace_graph(path: Path, content: bytes) -> None:
    source = BytesIO(path.read_bytes())
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, content if name.endswith(".onnx") else old.read(name))


@pytest.mark.parametrize("content", [b"", b"no graph", bytes(1000)])
def test_what_is_no_graph_is_refused(unlisted: Path, content: bytes) -> None:
    replace_graph(unlisted, content)
    with pytest.raises(ModelError, match=r"copy.onnx: ONNX Runtime cannot load the model .*again"):
        load_model(unlisted)


@pytest.mark.slow
def test_no_damage_ends_the_process(onnx_file: Path, tmp_path: Path) -> None:
    valid = onnx_file.read_bytes()
    outcomes = load_in_one_process([valid, *mutations([valid], 300, seed=1)], ".onnx", tmp_path)
    assert outcomes["loaded"] >= 1, "the model itself"
    assert outcomes["refused"] > 250
    assert outcomes["not loaded"] == 0, "what the checksums do not show is no damage"


@pytest.mark.slow
def test_crafted_graphs_are_refused_or_work(onnx_file: Path, tmp_path: Path) -> None:
    def read(data: bytes) -> None:
        path = tmp_path / "crafted.onnx"
        path.write_bytes(data)
        load_model(path)

    counts = read_all(read, damaged_members(onnx_file.read_bytes(), 12, seed=3))
    assert counts["refused"]


def test_weights_are_recovered_from_torchscript_alone(onnx_file: Path) -> None:
    with pytest.raises(ModelError, match=r"from TorchScript files \(\.pt\) alone"):
        recover_generator(onnx_file)
