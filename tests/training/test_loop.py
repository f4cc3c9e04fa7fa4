from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.synthetic import SMALL, TINY_PATCHES, threaded_source
from helpers.tiny_model import TINY

torch = pytest.importorskip("torch")

from cbagan_ompl import ConfigError
from cbagan_ompl.training import loop
from cbagan_ompl.training.checkpoints import load_checkpoint
from cbagan_ompl.training.export import export
from cbagan_ompl.training.gan import Gan, Painted
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import DatasetSource


def equal(a: Any, b: Any) -> bool:
    if isinstance(a, torch.Tensor):
        return torch.equal(a, b)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(equal, a, b))
    return bool(a == b)


def test_resumed_run_equals_uninterrupted(
    source: DatasetSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = train(source, TINY, tmp_path / "whole", device="cpu", progress=False)

    epochs = loop._train_epoch

    def interrupted(*args: Any) -> dict[str, float]:
        if args[4] == 1:
            raise KeyboardInterrupt
        return epochs(*args)

    monkeypatch.setattr(loop, "_train_epoch", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(source, TINY, tmp_path / "parts", device="cpu", progress=False)
    assert len((tmp_path / "parts" / "log.jsonl").read_text().splitlines()) == 1
    monkeypatch.undo()
    parts = train(source, TINY, tmp_path / "parts", resume=True, device="cpu", progress=False)

    assert parts["test"] == whole["test"]
    states = [load_checkpoint(tmp_path / run / "last.pt") for run in ("whole", "parts")]
    for key in ("gan", "rng", "noise_rng", "config", "dataset"):
        assert equal(states[0][key], states[1][key]), key
    assert [entry["losses"] for entry in states[0]["history"]] == [
        entry["losses"] for entry in states[1]["history"]
    ]


def test_lack_of_memory_is_said(
    source: DatasetSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "discriminator_step", lambda *_: torch.empty(2**50))
    said = r"not enough memory to train on batches of \d+ images of \d+ pixels: lower batch_size"
    with pytest.raises(ConfigError, match=said):
        train(source, TINY, tmp_path, device="cpu", progress=False)


def test_a_resumed_run_on_synthetic_maps_equals_an_uninterrupted_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:

    def train(folder: str, resume: bool = False) -> dict[str, Any]:
        with threaded_source() as source:
            return loop.train(
                source, TINY_PATCHES, tmp_path / folder, resume=resume, device="cpu", progress=False
            )

    whole, step = train("whole"), loop._train_epoch

    def interrupted(*args: Any) -> dict[str, float]:
        if args[4] == 1:
            raise KeyboardInterrupt
        return step(*args)

    with monkeypatch.context() as patch:
        patch.setattr(loop, "_train_epoch", interrupted)
        with pytest.raises(KeyboardInterrupt):
            train("parts")
    parts = train("parts", resume=True)
    assert parts["test"] == whole["test"]
    one, other = (load_checkpoint(tmp_path / name / "last.pt") for name in ("whole", "parts"))
    assert one["dataset"] == other["dataset"]
    for name in ("generator", "map_discriminator", "average"):
        for key, value in one["gan"][name].items():
            assert torch.equal(value, other["gan"][name][key]), (name, key)

    other_tasks = pytest.raises(ConfigError, match="belongs to another data set")
    with threaded_source(replace(SMALL, seed=4)) as source, other_tasks:
        loop.train(source, TINY_PATCHES, tmp_path / "parts", resume=True, progress=False)


@pytest.mark.slow
def test_training_learns(source: DatasetSource, tmp_path: Path) -> None:
    # The region turns the same way in every task, so mirrored tasks would contradict each other.
    config = TINY.updated(
        {"epochs": 30, "generator_lr": 0.01, "ema_decay": 0.5, "symmetries": False}
        | {"reversal": False}
    )
    result = train(source, config, tmp_path, device="cpu", progress=False)
    assert result["test"]["iou"] > result["trivial"]["straight line"]["iou"] + 0.1
    log = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert len(log) == 30
    assert {"adversarial", "map_discriminator", "point_discriminator"} <= log[-1]["losses"].keys()
    assert log[-1]["losses"]["segmentation"] < log[0]["losses"]["segmentation"] / 2


def test_resume_needs_the_same_recipe(source: DatasetSource, tmp_path: Path) -> None:
    config = TINY.updated({"epochs": 1})
    train(source, config, tmp_path, device="cpu", progress=False)
    with pytest.raises(ConfigError, match="resume"):
        train(source, config, tmp_path, device="cpu", progress=False)
    with pytest.raises(ConfigError, match="seed"):
        train(source, config.updated({"seed": 1}), tmp_path, resume=True, progress=False)


def test_a_run_starts_from_the_weights_of_another(source: DatasetSource, tmp_path: Path) -> None:
    first = train(source, TINY, tmp_path / "first", device="cpu", progress=False)
    still = TINY.updated(
        {"epochs": 1, "generator_lr": 1e-12, "map_discriminator_lr": 1e-12, "scales": [1, 2]}
    )
    again = train(
        source,
        still,
        tmp_path / "again",
        start_from=first["checkpoint"],
        device="cpu",
        progress=False,
    )
    before, after = (load_checkpoint(run["checkpoint"])["gan"] for run in (first, again))
    for name, weights in before["average"].items():
        if name.endswith("weight"):
            torch.testing.assert_close(after["generator"][name], weights, rtol=0, atol=1e-6)
    wider = TINY.updated({"widths": [4, 4, 6, 16]})
    with pytest.raises(ConfigError, match="other networks"):
        train(source, wider, tmp_path / "wider", start_from=first["checkpoint"], progress=False)


def test_resume_goes_on_where_a_run_ended_before_its_first_epoch(
    source: DatasetSource, tmp_path: Path
) -> None:
    config = TINY.updated({"epochs": 1})
    whole = train(source, config, tmp_path / "whole", device="cpu", progress=False)
    (tmp_path / "run").mkdir()
    # The best epoch is written before the last one.
    shutil.copy(tmp_path / "whole" / "best.pt", tmp_path / "run")
    run = train(source, config, tmp_path / "run", resume=True, device="cpu", progress=False)
    assert run["test"] == whole["test"]


def test_a_longer_run_goes_on_where_a_shorter_one_ended(
    source: DatasetSource, tmp_path: Path
) -> None:
    # A schedule that does not depend on the number of epochs.
    long = TINY.updated({"schedule": "exponential"})
    short = long.updated({"epochs": 1})
    whole = train(source, long, tmp_path / "whole", device="cpu", progress=False)
    train(source, short, tmp_path / "parts", device="cpu", progress=False)
    parts = train(source, long, tmp_path / "parts", resume=True, device="cpu", progress=False)
    assert parts["test"] == whole["test"]
    states = [load_checkpoint(tmp_path / run / "last.pt") for run in ("whole", "parts")]
    assert equal(states[0]["gan"], states[1]["gan"])
    assert states[1]["config"]["epochs"] == 2
    with pytest.raises(ConfigError, match="2 epochs behind it, more than the 1 asked for"):
        train(source, short, tmp_path / "parts", resume=True, device="cpu", progress=False)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"adversarial_every": 1}, [0, 1, 2]),
        ({"adversarial_every": 2}, [0, 2]),
        ({"adversarial_weight": 0}, []),
    ],
)
def test_the_steps_with_discriminators(
    source: DatasetSource, options: dict[str, Any], expected: list[int]
) -> None:
    config = TINY.updated(options)
    gan = Gan(config, torch.device("cpu"))
    run = loop.Run(gan, np.random.default_rng(0), torch.Generator())
    tasks = source.epoch(0)
    with_discriminators = []
    for step in range(3):
        losses = loop._step(run, config, tasks, np.arange(4), torch.device("cpu"), step)
        assert {"pixel", "segmentation"} <= losses.keys()
        both = {"adversarial", "map_discriminator", "point_discriminator"}
        if losses.keys() & both:
            assert both <= losses.keys()
            with_discriminators.append(step)
    assert with_discriminators == expected


@pytest.mark.parametrize(
    ("options", "symmetries", "reversals", "sizes"),
    [
        ({"symmetries": False}, 1, 1, {32}),
        ({"symmetries": True}, 8, 1, {32}),
        ({"symmetries": False, "reversal": True}, 1, 2, {32}),
        ({"symmetries": False, "scales": [1, 2]}, 1, 1, {32, 16}),
    ],
)
def test_what_the_generator_is_trained_on(
    source: DatasetSource,
    monkeypatch: pytest.MonkeyPatch,
    options: dict[str, Any],
    symmetries: int,
    reversals: int,
    sizes: set[int],
) -> None:
    config = TINY.updated({"adversarial_weight": 0, **options})
    gan, cpu = Gan(config, torch.device("cpu")), torch.device("cpu")
    run = loop.Run(gan, np.random.default_rng(0), torch.Generator().manual_seed(0))
    seen: list[tuple[torch.Tensor, ...]] = []
    original = gan.generate

    def record(*inputs: torch.Tensor) -> Painted:
        seen.append(inputs)
        return original(*inputs)

    monkeypatch.setattr(gan, "generate", record)
    for step in range(40):
        loop._step(run, config, source.epoch(0), np.zeros(2, np.int64), cpu, step)
    assert {inputs[0].shape[-1] for inputs in seen} == sizes
    whole = [inputs for inputs in seen if inputs[0].shape[-1] == 32]
    points = {image.numpy().tobytes() for inputs in whole for image in inputs[1]}
    assert len(points) == symmetries * reversals
    noise = torch.cat([inputs[2].flatten() for inputs in seen])
    assert abs(float(noise.mean())) < 0.05
    assert abs(float(noise.std()) - 1) < 0.05


def test_learning_rates_of_an_epoch(source: DatasetSource, monkeypatch: pytest.MonkeyPatch) -> None:
    config = TINY.updated(
        {"schedule": "exponential", "decay": 0.5, "plateau_patience": 1, "plateau_factor": 0.1}
    )
    gan, cpu = Gan(config, torch.device("cpu")), torch.device("cpu")
    run = loop.Run(gan, np.random.default_rng(0), torch.Generator().manual_seed(0))
    run.history = [{"validation": {"iou": iou}} for iou in (0.5, 0.4, 0.3)]
    factors: list[float] = []
    monkeypatch.setattr(gan, "set_learning_rates", factors.append)
    loop._train_epoch(run, config, source.epoch(3), cpu, 3, False)
    assert factors == pytest.approx([0.1 * 0.5**3] * len(factors))
    assert factors


@pytest.mark.parametrize("decay", [0.0, 0.5])
def test_the_average_is_validated_and_the_best_epoch_kept(
    source: DatasetSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, decay: float
) -> None:
    config = TINY.updated({"ema_decay": decay, "epochs": 3})
    ious = iter((0.2, 0.3, 0.1))
    validated: list[dict[str, torch.Tensor]] = []

    def evaluate(generator: torch.nn.Module, *_: Any) -> dict[str, float]:
        validated.append({k: v.clone() for k, v in generator.state_dict().items()})
        names = ("dice", "precision", "recall", "connectivity")
        return {"iou": next(ious, 0.0), **dict.fromkeys(names, 0.0)}

    monkeypatch.setattr(loop, "evaluate", evaluate)
    run = train(source, config, tmp_path, device="cpu", progress=False)
    assert run["epoch"] == 2
    state = load_checkpoint(tmp_path / "last.pt")["gan"]
    assert equal(validated[2], state["average" if decay else "generator"])
    assert equal(state["average"], state["generator"]) == (decay == 0)


def test_segmentation_alone_trains_exports_and_resumes(
    source: DatasetSource, tmp_path: Path
) -> None:
    config = TINY.updated({"adversarial_weight": 0, "epochs": 1})
    run = train(source, config, tmp_path / "run", device="cpu", progress=False)
    longer = config.updated({"epochs": 2})
    train(source, longer, tmp_path / "run", resume=True, device="cpu", progress=False)
    state = load_checkpoint(run["checkpoint"])
    assert "map_discriminator" not in state["gan"]
    export(run["checkpoint"], tmp_path / "alone.pt")
    card = " ".join((tmp_path / "alone.md").read_text().split())
    assert "trained for segmentation alone, without discriminators" in card


@pytest.mark.parametrize("name", ["last.pt", "best.pt", "log.jsonl"])
def test_a_run_writes_over_no_file_that_it_did_not_write(
    source: DatasetSource, tmp_path: Path, name: str
) -> None:
    (tmp_path / name).write_text("of somebody else")
    with pytest.raises(ConfigError, match=f"or another {name}"):
        train(source, TINY, tmp_path, progress=False)
    assert (tmp_path / name).read_text() == "of somebody else"


def test_output_that_is_a_file(source: DatasetSource, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="cannot make the folder"):
        train(source, TINY, tmp_path / "file", progress=False)


@pytest.mark.parametrize(
    "options", [{"precision": "bfloat16"}, {"self_attention": True, "widths": [8, 8, 8, 8]}]
)
def test_variants_train(source: DatasetSource, tmp_path: Path, options: dict[str, Any]) -> None:
    config = TINY.updated({"epochs": 1, "discriminator_width": 8, **options})
    result = train(source, config, tmp_path, device="cpu", progress=False)
    weights = load_checkpoint(result["checkpoint"])["gan"]["generator"]
    assert all(value.dtype != torch.bfloat16 for value in weights.values())
