from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from helpers.training_set import SIDE, write_training_set

torch = pytest.importorskip("torch")

from cbagan_ompl import ConfigError, DatasetError, MissingDependencyError, ModelError
from cbagan_ompl.cli.train import add_export_parser, add_train_parser
from cbagan_ompl.datasets.dataset import Dataset, load_dataset
from cbagan_ompl.networks.encoding import region_probability
from cbagan_ompl.training import gan as networks
from cbagan_ompl.training import loop as training
from cbagan_ompl.training import losses
from cbagan_ompl.training.batches import make_batch, scaled_down, transformed
from cbagan_ompl.training.checkpoints import load_checkpoint
from cbagan_ompl.training.config import TrainingConfig
from cbagan_ompl.training.distributed import GlobalBatchNorm, ProcessGroup
from cbagan_ompl.training.gan import Networks, encode
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.schedule import learning_rate_factor, plateau_factor
from cbagan_ompl.training.steps import adversarial_shares, discriminator_step, generator_step
from cbagan_ompl.training.task_sources import DatasetSource

TINY = TrainingConfig(
    epochs=2, batch_size=4, widths=(4, 4, 6, 8), discriminator_width=4, adversarial_every=2
)
CPU = torch.device("cpu")
NETWORKS = ("generator", "map_discriminator", "point_discriminator")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_training_set(tmp_path_factory.mktemp("data") / "tiny")


@pytest.fixture(scope="module")
def dataset(folder: Path) -> Dataset:
    return load_dataset(folder)


def source_of(dataset: Dataset) -> DatasetSource:
    return DatasetSource(dataset, TINY.validation_fraction, TINY.seed)


@pytest.fixture(scope="module")
def source(dataset: Dataset) -> DatasetSource:
    return source_of(dataset)


def weights(networks: Networks) -> dict[str, list[torch.Tensor]]:
    return {
        name: [p.detach().clone() for p in getattr(networks, name).parameters()]
        for name in NETWORKS
    }


def changed(before: list[torch.Tensor], after: list[torch.Tensor]) -> bool:
    return any(not torch.equal(a, b) for a, b in zip(before, after, strict=True))


def test_each_optimizer_owns_its_network_alone() -> None:
    networks = Networks(TINY, CPU)
    owned = {
        name: {id(p) for group in optimizer.param_groups for p in group["params"]}
        for name, optimizer in networks.optimizers.items()
    }
    for name in NETWORKS:
        assert owned[name] == {id(p) for p in getattr(networks, name).parameters()}
    assert len(set.union(*owned.values())) == sum(map(len, owned.values()))


def test_steps_change_the_weights_that_they_teach(dataset: Dataset) -> None:
    networks = Networks(TINY, CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    before = weights(networks)
    fake = networks.generator(images.map, images.points, torch.zeros_like(batch.free))

    discriminator_step(networks, images, fake)
    after = weights(networks)
    assert [changed(before[name], after[name]) for name in NETWORKS] == [False, True, True]

    parts = generator_step(networks, TINY, batch, images, fake, (0.5, 0.5))
    assert parts["adversarial"] > 0
    last = weights(networks)
    assert [changed(after[name], last[name]) for name in NETWORKS] == [True, False, False]
    assert all(p.requires_grad for p in networks.map_discriminator.parameters())


def test_the_discriminators_reach_the_generator(dataset: Dataset) -> None:
    config = TINY.updated({"pixel_weight": 0, "bce_weight": 0, "dice_weight": 0})
    networks = Networks(config.updated({"weight_decay": 0}), CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    before = weights(networks)["generator"]
    fake = networks.generator(images.map, images.points, torch.zeros_like(batch.free))
    generator_step(networks, config, batch, images, fake, (0.5, 0.5))
    assert changed(before, weights(networks)["generator"])


def test_the_recipes_weights_reach_the_segmentation_loss(dataset: Dataset) -> None:
    weights = {"bce_weight": 2, "dice_weight": 3, "dice_smooth": 4, "positive_weight": 5}
    config = TINY.updated(weights)
    networks = Networks(config, CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    fake = networks.generator(images.map, images.points, torch.zeros_like(batch.free))
    expected = losses.segmentation_loss(region_probability(fake), batch.region, 2, 3, 4, 5).item()
    parts = generator_step(networks, config, batch, images, fake, None)
    assert parts["segmentation"] == pytest.approx(expected)


@pytest.mark.parametrize("limit", [0.0, 0.01])
def test_long_gradients_are_shortened(dataset: Dataset, limit: float) -> None:
    config = TINY.updated({"clip_norm": limit})
    networks = Networks(config, CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    fake = networks.generator(images.map, images.points, torch.zeros_like(batch.free))
    generator_step(networks, config, batch, images, fake, None)
    gradients = [w.grad for w in networks.generator.parameters() if w.grad is not None]
    norm = float(torch.linalg.vector_norm(torch.cat([g.flatten() for g in gradients])))
    if limit:
        assert norm == pytest.approx(limit, rel=1e-3)
    else:
        assert norm > 0.01, "or the other case would show nothing"


def test_average_follows_the_generator() -> None:
    networks = Networks(TINY, CPU)
    with torch.no_grad():
        for parameter in networks.generator.parameters():
            parameter.add_(1)
    start = next(networks.average.parameters()).clone()
    networks.update_average(0.75, step=1000)
    torch.testing.assert_close(next(networks.average.parameters()), start + 0.25)


def equal(a: Any, b: Any) -> bool:
    if isinstance(a, torch.Tensor):
        return torch.equal(a, b)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(equal, a, b))
    return bool(a == b)


def test_resumed_run_equals_uninterrupted(
    dataset: Dataset, source: DatasetSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = train(source, TINY, tmp_path / "whole", device="cpu", progress=False)

    epochs = training._train_epoch

    def interrupted(*args: Any) -> dict[str, float]:
        if args[4] == 1:
            raise KeyboardInterrupt
        return epochs(*args)

    monkeypatch.setattr(training, "_train_epoch", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(source, TINY, tmp_path / "parts", device="cpu", progress=False)
    assert len((tmp_path / "parts" / "log.jsonl").read_text().splitlines()) == 1
    monkeypatch.undo()
    parts = train(source, TINY, tmp_path / "parts", resume=True, device="cpu", progress=False)

    assert parts["test"] == whole["test"]
    states = [load_checkpoint(tmp_path / run / "last.pt") for run in ("whole", "parts")]
    for key in ("networks", "rng", "noise_rng", "config", "dataset"):
        assert equal(states[0][key], states[1][key]), key
    assert [entry["losses"] for entry in states[0]["history"]] == [
        entry["losses"] for entry in states[1]["history"]
    ]


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


def test_resume_refuses_another_recipe(source: DatasetSource, tmp_path: Path) -> None:
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
    before, after = (load_checkpoint(run["checkpoint"])["networks"] for run in (first, again))
    for name, weights in before["average"].items():
        if name.endswith("weight"):
            torch.testing.assert_close(after["generator"][name], weights, rtol=0, atol=1e-6)
    wider = TINY.updated({"widths": [4, 4, 6, 16]})
    with pytest.raises(ConfigError, match="other networks"):
        train(source, wider, tmp_path / "wider", start_from=first["checkpoint"], progress=False)


def test_resume_without_a_run(source: DatasetSource, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no such file"):
        train(source, TINY, tmp_path, resume=True, progress=False)


def test_output_that_is_a_file(source: DatasetSource, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError, match="cannot make the folder"):
        train(source, TINY, tmp_path / "file", progress=False)


def test_checkpoint_that_is_none(source: DatasetSource, tmp_path: Path) -> None:
    (tmp_path / "last.pt").write_text("text")
    with pytest.raises(ModelError, match="not a training checkpoint, or a damaged one"):
        train(source, TINY, tmp_path, resume=True, progress=False)


def test_unknown_device() -> None:
    with pytest.raises(ConfigError, match="nonsense"):
        training.pick_device("nonsense")


@pytest.mark.parametrize(
    ("name", "rank", "expected"), [("auto", "1", 1), ("cuda", "2", 2), ("cuda:0", "1", 0)]
)
def test_each_process_has_its_own_gpu(
    monkeypatch: pytest.MonkeyPatch, name: str, rank: str, expected: int
) -> None:
    placed, current = [], []
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "set_device", current.append)
    monkeypatch.setattr(networks.torch, "empty", lambda *_, device: placed.append(device))
    monkeypatch.setenv("LOCAL_RANK", rank)
    device = networks.pick_device(name)
    assert device == torch.device("cuda", expected)
    assert placed == current == [device]


def test_one_process_takes_the_first_gpu_or_the_cpu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LOCAL_RANK", raising=False)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert networks.pick_device("auto") == CPU
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "set_device", lambda device: None)
    monkeypatch.setattr(networks.torch, "empty", lambda *_, device: None)
    assert networks.pick_device("auto") == torch.device("cuda", 0)


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
    scores = np.random.default_rng(0).random(60).tolist()
    config = TINY.updated({"plateau_patience": 3, "plateau_factor": 0.5})
    optimizer = torch.optim.SGD([torch.zeros(1, requires_grad=True)], lr=1.0)
    schedule = torch.optim.lr_scheduler.ReduceLROnPlateau(
        optimizer, "max", factor=0.5, patience=3, threshold=0.0, eps=0.0
    )
    for n, score in enumerate(scores):
        schedule.step(score)
        assert plateau_factor(config, scores[: n + 1]) == optimizer.param_groups[0]["lr"]


def test_adaptive_shares_of_a_recipe() -> None:
    errors = {"map_discriminator": 0.2, "point_discriminator": 0.4}
    assert adversarial_shares(TINY, errors) == (0.5, 0.5)
    adaptive = TINY.updated({"adaptive_alpha": 3})
    assert adversarial_shares(adaptive, errors) == pytest.approx((0.6, 0.4))


@pytest.mark.parametrize(
    "options", [{"precision": "bfloat16"}, {"self_attention": True, "widths": [8, 8, 8, 8]}]
)
def test_variants_train(source: DatasetSource, tmp_path: Path, options: dict[str, Any]) -> None:
    config = TINY.updated({"epochs": 1, "discriminator_width": 8, **options})
    result = train(source, config, tmp_path, device="cpu", progress=False)
    weights = load_checkpoint(result["checkpoint"])["networks"]["generator"]
    assert all(value.dtype != torch.bfloat16 for value in weights.values())


def test_tensorboard_is_optional(
    source: DatasetSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    with pytest.raises(MissingDependencyError, match=r"cbagan-ompl\[tensorboard\]"):
        train(source, TINY, tmp_path, device="cpu", progress=False, tensorboard=True)


def test_tensorboard_gets_losses_and_scores(source: DatasetSource, tmp_path: Path) -> None:
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    train(source, TINY, tmp_path, device="cpu", progress=False, tensorboard=True)
    events = EventAccumulator(str(tmp_path)).Reload()
    history = load_checkpoint(tmp_path / "last.pt")["history"]
    for group, name in (("validation", "iou"), ("losses", "pixel")):
        values = [event.value for event in events.Scalars(f"{group}/{name}")]
        assert values == pytest.approx([entry[group][name] for entry in history])


# --- several processes ----------------------------------------------------------------------------


def torchrun(processes: int, *words: str) -> None:
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone"]
    command += [f"--nproc-per-node={processes}", *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture
def alone(tmp_path: Path) -> Iterator[None]:
    """A group of this process only."""
    store = (tmp_path / "store").as_uri()
    torch.distributed.init_process_group("gloo", init_method=store, rank=0, world_size=1)
    yield
    torch.distributed.destroy_process_group()


@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize(("kind", "tolerance"), [(torch.float32, 1e-5), (torch.bfloat16, 1e-2)])
def test_global_batch_norm_is_batch_norm(kind: torch.dtype, tolerance: float) -> None:
    features = (3 + 2 * torch.randn(4, 5, 6, 7)).to(kind)
    results = []
    for norm in (torch.nn.BatchNorm2d(5), GlobalBatchNorm(5)):
        taken = features.clone().requires_grad_()
        normal = norm(taken)
        (normal * torch.linspace(-1, 1, 7)).sum().backward()
        results.append([normal, taken.grad, norm.running_mean, norm.running_var])
    for expected, value in zip(*results, strict=True):
        assert value.dtype == expected.dtype
        torch.testing.assert_close(value, expected, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize(("tasks", "size"), [(15, 14), (16, 16), (40, 32), (2, 2)])
def test_all_processes_have_as_many_tasks(tasks: int, size: int) -> None:
    group = ProcessGroup(1, 2)
    assert training._batch_size(tasks, TINY.updated({"batch_size": 32}), group) == size


def test_too_few_tasks_for_the_processes() -> None:
    with pytest.raises(ConfigError, match="4 processes cannot share 3 training tasks"):
        training._batch_size(3, TINY, ProcessGroup(0, 4))


def test_two_processes_have_the_gradients_of_one(folder: Path, tmp_path: Path) -> None:
    script = str(Path(__file__).parents[1] / "helpers" / "first_gradients.py")
    for processes in (1, 2):
        torchrun(processes, script, str(folder), str(tmp_path / f"{processes}.pt"))
    one, two = (torch.load(tmp_path / f"{n}.pt") for n in (1, 2))
    assert one.keys() == two.keys()
    for name in one:
        scale = one[name].abs().max().item()
        torch.testing.assert_close(two[name], one[name], rtol=0, atol=1e-4 * scale, msg=name)


def test_training_under_torchrun(folder: Path, tmp_path: Path) -> None:
    words = ["--epochs", "1", "--device", "cpu", "--set", "widths=[4,4,6,8]", "batch_size=4"]
    words += ["discriminator_width=4", "adversarial_every=1"]
    for processes in (1, 2):
        run = ["train", str(folder), "--output", str(tmp_path / str(processes)), *words]
        torchrun(processes, "-m", "cbagan_ompl.cli", *run)
    logs = [json.loads((tmp_path / n / "log.jsonl").read_text()) for n in "12"]
    assert logs[1]["losses"] == pytest.approx(logs[0]["losses"], rel=1e-3)


def test_batches_that_cannot_be_shared(folder: Path, tmp_path: Path) -> None:
    words = ["train", str(folder), "--output", str(tmp_path / "run"), "--device", "cpu"]
    with pytest.raises(AssertionError, match="batches of 5 cannot be shared evenly by 2 processes"):
        torchrun(2, "-m", "cbagan_ompl.cli", *words, "--set", "batch_size=5")


# --- the data set ---------------------------------------------------------------------------------


def test_dataset_content(dataset: Dataset) -> None:
    assert (len(dataset.train), len(dataset.test)) == (16, 4)
    assert dataset.description()["side"] == SIDE
    tasks = dataset.test
    for i in range(len(tasks)):
        (u, v), (column, row) = tasks.start[i], tasks.goal[i].astype(int)
        assert (u, v % 1) == (2.5, 0.5)
        assert tasks.region[i, int(v), 2] == tasks.region[i, row, column] == 1
        assert not tasks.free[i, 15, 15]
        assert tasks.free[i, 0, 0]


def test_split_is_seeded_and_disjoint(dataset: Dataset) -> None:
    (a, b), (c, d) = dataset.split(0.25, 3), dataset.split(0.25, 3)
    assert (len(a), len(b)) == (12, 4)
    assert np.array_equal(a.region, c.region)
    assert np.array_equal(b.region, d.region)
    everything = np.concatenate((a.goal, b.goal))
    assert sorted(everything.tolist()) == sorted(dataset.train.goal.tolist())


def test_symmetries_move_points_with_the_images(dataset: Dataset) -> None:
    tasks = dataset.train
    free, region = tasks.maps[tasks.map_of[0]], tasks.region[0]
    ends = np.stack((tasks.start[0], tasks.goal[0]))
    seen = set()
    for code in range(8):
        turned_free, turned, moved = transformed(code, free, region, ends)
        assert turned.sum() == region.sum()
        for before, after in zip(ends.astype(int), moved.astype(int), strict=True):
            assert turned[after[1], after[0]] == region[before[1], before[0]]
        seen.add((turned_free.tobytes(), turned.tobytes()))
    assert len(seen) == 8


def test_smaller_maps_keep_passages_and_regions(dataset: Dataset) -> None:
    batch = make_batch(dataset.train, np.arange(3), CPU)
    assert scaled_down(batch, 1) is batch
    half = scaled_down(batch, 2)
    assert half.free.shape == half.region.shape == (3, 1, SIDE // 2, SIDE // 2)
    assert torch.equal(half.start, batch.start / 2)
    for small, full in ((half.free, batch.free), (half.region, batch.region)):
        blocks = full.unfold(2, 2, 2).unfold(3, 2, 2)
        assert torch.equal(small, blocks.amax((4, 5)))


def test_augmented_batches_are_seeded(dataset: Dataset) -> None:
    def draw(seed: int) -> torch.Tensor:
        rng = np.random.default_rng(seed)
        batch = make_batch(dataset.train, np.arange(8), CPU, rng, symmetries=True, reversal=True)
        return torch.cat((batch.start, batch.goal, batch.region.flatten(1)), 1)

    assert torch.equal(draw(0), draw(0))
    assert not torch.equal(draw(0), draw(1))


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda root: (root / "train.csv").unlink(), "train.csv"),
        (lambda root: (root / "test.csv").write_text("map,task\na,b\n"), "column roi is missing"),
        (lambda root: (root / "test.csv").write_text("map,task,roi\n"), "empty"),
        (lambda root: (root / "maps" / "map_1.png").unlink(), "map_1.png"),
        (lambda root: (root / "tasks/map_0/task_1_roi.png").write_bytes(b"text"), "not an image"),
        (
            lambda root: cv2.imwrite(
                str(root / "tasks/map_0/task_1_roi.png"), np.zeros((8, 9, 3), np.uint8)
            ),
            "9 x 8 pixels",
        ),
        (
            lambda root: cv2.imwrite(
                str(root / "tasks/map_0/task_1.png"), np.full((SIDE, SIDE, 3), 255, np.uint8)
            ),
            "start is missing",
        ),
        (
            lambda root: cv2.imwrite(
                str(root / "maps/map_0.png"), np.full((20, 32, 3), 255, np.uint8)
            ),
            "squares; map_0.png has 32 x 20",
        ),
    ],
)
def test_damaged_sets(tmp_path: Path, damage: Any, message: str) -> None:
    root = write_training_set(tmp_path / "set")
    damage(root)
    with pytest.raises(DatasetError, match=message):
        load_dataset(root)


def test_images_of_a_size_that_the_networks_cannot_take(dataset: Dataset, tmp_path: Path) -> None:
    cut = replace(dataset.train, maps=dataset.train.maps[:, :20, :20])
    cut = replace(cut, region=cut.region[:, :20, :20])
    with pytest.raises(DatasetError, match="a multiple of 16 pixels; these have 20"):
        train(source_of(replace(dataset, train=cut)), TINY, tmp_path, device="cpu", progress=False)


def test_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no such folder"):
        load_dataset(tmp_path / "none")


# --- the recipe -----------------------------------------------------------------------------------


def test_paper_preset_is_the_papers_table() -> None:
    paper = TrainingConfig.preset("paper")
    assert (paper.epochs, paper.batch_size, paper.generator_lr) == (20, 8, 1e-4)
    assert paper.map_discriminator_lr == paper.point_discriminator_lr == 5e-5
    assert (paper.beta1, paper.beta2, paper.schedule) == (0.5, 0.999, "exponential")


@pytest.mark.parametrize("suffix", [".json", ".yaml"])
def test_config_file_round_trip(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"recipe{suffix}"
    path.write_text(json.dumps(TINY.to_dict()))
    assert TrainingConfig.from_file(path) == TINY


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("epochs: 0", "epochs must be at least 1"),
        ("epoch: 3", "unknown option 'epoch'"),
        ("epochs: many", "epochs must be a value of type int"),
        ("epochs: true", "epochs must be"),
        ("widths: [4, 4]", "widths are three or more"),
        ("schedule: none", "one-cycle, exponential"),
        ("precision: float64", "float32, bfloat16"),
        ("plateau_factor: 2", "plateau_factor must be above 0"),
        ("generator_lr: fast", "generator_lr"),
        ("beta1: .nan", "beta1"),
        ("seed: -1", "seed must be at least 0"),
        ("seed: 99999999999999999999", r"seed must be below 2\*\*63"),
        ("{self_attention: true, widths: [8, 8, 7, 8]}", "all widths but the first .* least 8"),
        ("[1, 2]", "holds lines such as"),
        ("a: [", "neither JSON nor YAML"),
    ],
)
def test_bad_config_files(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "recipe.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        TrainingConfig.from_file(path)


def test_unreadable_config_and_unknown_preset(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot read"):
        TrainingConfig.from_file(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match="best, worlds, paper"):
        TrainingConfig.preset("worst")


def test_the_greatest_seed() -> None:
    config = TINY.updated({"seed": 2**63 - 1})
    Networks(config, CPU)
    torch.Generator().manual_seed(config.seed)
    np.random.default_rng(config.seed)


def test_numbers_that_yaml_reads_as_text() -> None:
    assert TrainingConfig().updated({"generator_lr": "1e-4"}).generator_lr == 1e-4


# --- the commands ---------------------------------------------------------------------------------


def parse(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers()
    add_train_parser(commands)
    add_export_parser(commands)
    return parser.parse_args(words)


def test_train_and_export_commands(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recipe = tmp_path / "recipe.yaml"
    recipe.write_text("widths: [4, 4, 6, 8]\nbatch_size: 8\n")
    words = ["train", str(folder), "--output", str(tmp_path / "run"), "--config", str(recipe)]
    words += ["--set", "discriminator_width=4", "batch_size=4", "--epochs", "1"]
    words += ["--device", "cpu", "--json", str(tmp_path / "scores.json")]
    args = parse(*words)
    assert args.run(args) == 0
    assert "straight line" in capsys.readouterr().out
    assert 0 <= json.loads((tmp_path / "scores.json").read_text())["test"]["iou"] <= 1
    state = load_checkpoint(tmp_path / "run" / "best.pt")
    assert (state["config"]["batch_size"], state["config"]["epochs"]) == (4, 1)

    args = parse("export", str(tmp_path / "run/best.pt"), "--output", str(tmp_path / "tiny.pt"))
    assert args.run(args) == 0
    assert {"tiny.pt", "tiny.md", "manifest.json"} <= {p.name for p in tmp_path.iterdir()}


@pytest.mark.parametrize("words", [["--set", "epochs"], ["--set", "epoch=1"], ["--threads", "0"]])
def test_bad_train_options(folder: Path, tmp_path: Path, words: list[str]) -> None:
    args = parse("train", str(folder), "--output", str(tmp_path), *words)
    with pytest.raises(ConfigError):
        args.run(args)
