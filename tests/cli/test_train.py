from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pytest
from helpers.synthetic import TINY_PATCHES
from helpers.tiny_model import TINY
from helpers.training_set import write_training_set

pytest.importorskip("torch")

import torch

from cbagan_ompl import ConfigError, DatasetError, GridMap, ModelError
from cbagan_ompl.cli import main
from cbagan_ompl.cli.train import add_export_parser, add_train_parser
from cbagan_ompl.inference.bundled_models import bundled_model
from cbagan_ompl.inference.predictor import load_model
from cbagan_ompl.training.checkpoints import load_checkpoint
from cbagan_ompl.training.export import export
from cbagan_ompl.training.model_weights import recover_generator


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_training_set(tmp_path_factory.mktemp("data") / "tiny")


STEP = "cbagan_ompl.training.loop._train_epoch"


def run(*words: str) -> int:
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers()
    add_train_parser(commands)
    add_export_parser(commands)
    parser.set_defaults(force=False)
    args = parser.parse_args(words)
    return int(args.run(args))


@pytest.mark.parametrize("start", ["cbagan-worlds", "a file"])
def test_refining_a_model(
    start: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = str(bundled_model("cbagan-worlds")) if start == "a file" else start
    words = ["train", str(folder), "--output", str(tmp_path / "run"), "--preset", "refine"]
    words += ["--start-from", before, "--set", "epochs=1", "batch_size=4", "generator_lr=1e-9"]
    assert run(*words) == 0
    refined = load_checkpoint(tmp_path / "run" / "best.pt")["gan"]["average"]
    weights = recover_generator(bundled_model("cbagan-worlds")).state_dict()
    assert torch.allclose(refined["head.weight"], weights["head.weight"], atol=1e-6)
    assert "best epoch" in capsys.readouterr().out


def test_refining_what_is_not_there(folder: Path, tmp_path: Path) -> None:
    words = ["train", str(folder), "--output", str(tmp_path / "run"), "--start-from"]
    with pytest.raises(ModelError, match="no-such-model"):
        run(*words, "no-such-model")
    with pytest.raises(ModelError, match="no such file"):
        run(*words, str(tmp_path / "missing.pt"))


def test_train_and_export_commands(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text("widths: [4, 4, 6, 8]\nbatch_size: 8\n")
    words = ["train", str(folder), "--output", str(tmp_path / "run"), "--config", str(recipe)]
    words += ["--set", "discriminator_width=4", "batch_size=4", "--epochs", "1"]
    words += ["--device", "cpu", "--json", str(tmp_path / "scores.json")]
    assert run(*words) == 0
    assert "straight line" in capsys.readouterr().out
    assert 0 <= json.loads((tmp_path / "scores.json").read_text())["test"]["iou"] <= 1
    state = load_checkpoint(tmp_path / "run" / "best.pt")
    assert (state["config"]["batch_size"], state["config"]["epochs"]) == (4, 1)

    words = ["export", str(tmp_path / "run/best.pt"), "--output", str(tmp_path / "tiny.pt")]
    assert run(*words) == 0
    assert {"tiny.pt", "tiny.md", "manifest.json"} <= {p.name for p in tmp_path.iterdir()}
    capsys.readouterr()
    with pytest.raises(ConfigError, match=r"--format onnx writes a file .* ends in \.onnx"):
        run(*words, "--format", "onnx")
    card = (tmp_path / "tiny.md").read_bytes()
    for name in ("tiny.pt", "tiny.md", "manifest.json"):
        with pytest.raises(ConfigError, match="name of its own"):
            run(*words, "--json", str(tmp_path / name))
    assert (tmp_path / "tiny.md").read_bytes() == card


@pytest.mark.parametrize("kept", [False, True])
def test_what_an_interrupt_leaves(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    kept: bool,
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    recipe = tmp_path / "recipe.json"
    recipe.write_text(json.dumps(TINY.to_dict()))
    words = ["train", str(folder), "--output", str(tmp_path / "run"), "--config", str(recipe)]
    monkeypatch.setattr("cbagan_ompl.training.loop._finish" if kept else STEP, interrupt)
    assert main(words) == 130
    said = capsys.readouterr().err.splitlines()[-1]
    if kept:
        assert said == "interrupted; go on with the same command and --resume"
    else:
        assert said == "interrupted before anything was kept; begin again with the same command"


def test_segmentation_only(folder: Path, tmp_path: Path) -> None:
    recipe = tmp_path / "recipe.json"
    recipe.write_text(json.dumps(TINY.updated({"epochs": 1}).to_dict()))
    words = ["--config", str(recipe), "--segmentation-only", "--device", "cpu"]
    assert run("train", str(folder), "--output", str(tmp_path / "run"), *words) == 0
    state = load_checkpoint(tmp_path / "run" / "best.pt")
    assert state["config"]["adversarial_weight"] == 0
    assert "map_discriminator" not in state["gan"]


@pytest.mark.parametrize("words", [["--set", "epochs"], ["--set", "epoch=1"], ["--threads", "0"]])
def test_bad_train_options(folder: Path, tmp_path: Path, words: list[str]) -> None:
    with pytest.raises(ConfigError):
        run("train", str(folder), "--output", str(tmp_path), *words)


def test_train_and_export_on_synthetic_maps(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recipe = tmp_path / "recipe.json"
    recipe.write_text(json.dumps(TINY_PATCHES.updated({"epochs": 1}).to_dict()))
    words = ["--size", "64", "--maps", "2", "--held-out", "1", "--generators", "blocks,caves"]
    words += ["--hard-fraction", "0.5", "--synthetic-seed", "7", "--config", str(recipe)]
    words += ["--device", "cpu", "--output", str(tmp_path / "run")]
    assert run("train", "--synthetic", *words) == 0
    assert "16 training tasks an epoch, 8 for testing" in capsys.readouterr().out
    record = export(tmp_path / "run" / "best.pt", tmp_path / "synthetic.pt")
    assert record["working_size"] == 64
    assert record["dataset"]["synthetic"]["generators"] == ["blocks", "caves"]
    assert record["dataset"]["synthetic"]["hard_fraction"] == 0.5
    assert "2 new maps of 64 x 64" in (tmp_path / "synthetic.md").read_text()
    grid = GridMap(np.ones((100, 70)))
    assert load_model(tmp_path / "synthetic.pt").predict(grid, (5, 5), (60, 90)).region.any()


@pytest.mark.parametrize(
    ("words", "error", "message"),
    [
        (["set", "--synthetic"], ConfigError, "give one of both"),
        ([], ConfigError, "give one of both"),
        (["--synthetic", "--size", "72"], DatasetError, "a multiple of 16 pixels; these have 72"),
        (
            ["--synthetic", "--size", "96", "--set", "patch=4"],
            DatasetError,
            "a multiple of 64 pixels; these have 96",
        ),
        (
            ["--synthetic", "--generators", "castles"],
            ConfigError,
            "'castles'; there are blocked_cells",
        ),
        (
            ["--synthetic", "--preset", "synthetic", "--size", "64"],
            DatasetError,
            "discriminators take images of at least 96 pixels; these have 64",
        ),
        (["--synthetic", "--maps", "0"], ConfigError, "maps is a whole number of at least 1"),
        (["--synthetic", "--hard-fraction", "2"], ConfigError, "hard_fraction"),
    ],
)
def test_bad_options_are_reported_before_any_map_is_generated(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    error: type[Exception],
    message: str,
) -> None:
    # Whatever generates maps fails.
    monkeypatch.setattr("cbagan_ompl.training.task_sources.ProcessPoolExecutor", None)
    with pytest.raises(error, match=message):
        run("train", *words, "--output", str(tmp_path / "run"))
    assert not (tmp_path / "run").exists()
