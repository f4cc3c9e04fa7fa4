"""The training loop: discriminator step, generator step, validation, checkpoint."""

from __future__ import annotations

import copy
import json
import math
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from tqdm import tqdm

from ..errors import ConfigError, ModelError
from . import losses
from .config import TrainingConfig
from .dataset import Batch, Dataset, Tasks, make_batch
from .discriminators import Discriminator
from .encoding import map_image, point_image, region_image, region_probability
from .generator import Generator
from .metrics import region_scores

CHECKPOINT_SCHEMA = 1
LAST, BEST, LOG = "last.pt", "best.pt", "log.jsonl"

#: A predicted probability from here on counts as region.
THRESHOLD = 0.5

#: Half the width in pixels of the straight line that validation is compared with.
LINE_HALF_WIDTH = 3


class Networks:
    """The three networks, their optimisers, and the moving average of the generator.

    Each optimiser owns the weights of one network and of no other.

    Args:
        config: the recipe; ``config.seed`` decides the initial weights.
        device: where the weights live.
    """

    def __init__(self, config: TrainingConfig, device: torch.device) -> None:
        torch.manual_seed(config.seed)
        self.generator = make_generator(config)
        attention = (config.channel_attention, config.spatial_attention)
        self.map_discriminator = Discriminator(config.discriminator_width, *attention)
        self.point_discriminator = Discriminator(config.discriminator_width, *attention)
        self.average = copy.deepcopy(self.generator).requires_grad_(False).eval()
        rates = {
            "generator": config.generator_lr,
            "map_discriminator": config.map_discriminator_lr,
            "point_discriminator": config.point_discriminator_lr,
        }
        self.optimizers: dict[str, torch.optim.Optimizer] = {}
        for name, rate in rates.items():
            # Channels-last convolutions take two thirds of the time on a CPU.
            network = getattr(self, name).to(device, memory_format=torch.channels_last)
            self.optimizers[name] = torch.optim.AdamW(
                network.parameters(),
                lr=rate,
                betas=(config.beta1, config.beta2),
                weight_decay=config.weight_decay,
            )
        self.average.to(device, memory_format=torch.channels_last)
        self.rates = rates

    def set_learning_rates(self, factor: float) -> None:
        """Set each learning rate to ``factor`` times its highest value."""
        for name, optimizer in self.optimizers.items():
            for group in optimizer.param_groups:
                group["lr"] = factor * self.rates[name]

    @torch.no_grad()
    def update_average(self, decay: float, step: int) -> None:
        """Move the average towards the generator.

        Args:
            decay: weight of the old average; lower in the first steps, which have little to say.
            step: steps done so far.
        """
        decay = min(decay, (1 + step) / (10 + step))
        current = self.generator.state_dict()
        for name, value in self.average.state_dict().items():
            if value.is_floating_point():
                value.lerp_(current[name], 1 - decay)
            else:
                value.copy_(current[name])

    def state_dict(self) -> dict[str, Any]:
        """Weights and optimiser states."""
        state: dict[str, Any] = {name: getattr(self, name).state_dict() for name in self._modules}
        state["optimizers"] = {name: opt.state_dict() for name, opt in self.optimizers.items()}
        return state

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """The inverse of :meth:`state_dict`."""
        for name in self._modules:
            getattr(self, name).load_state_dict(state[name])
        for name, optimizer in self.optimizers.items():
            optimizer.load_state_dict(state["optimizers"][name])

    _modules = ("generator", "map_discriminator", "point_discriminator", "average")


def make_generator(config: TrainingConfig) -> Generator:
    """The generator that a recipe asks for, with fresh weights."""
    return Generator(config.widths, config.channel_attention, config.spatial_attention)


@dataclass(frozen=True)
class Images:
    """A batch as the networks see it, (B, 3, S, S) in [-1, 1] each."""

    map: Tensor
    points: Tensor
    region: Tensor


def encode(batch: Batch) -> Images:
    """Draw the images of a batch."""
    height, width = batch.free.shape[-2:]
    images = (
        map_image(batch.free),
        point_image(batch.start, batch.goal, height, width),
        region_image(batch.region),
    )
    return Images(*(image.contiguous(memory_format=torch.channels_last) for image in images))


def discriminator_step(networks: Networks, images: Images, fake: Tensor) -> dict[str, float]:
    """Teach both discriminators to tell the true regions from the generated ones.

    Args:
        networks: the weights of the two discriminators change, those of the generator do not.
        images: a batch.
        fake: the generated region images of the batch; no gradient flows back into them.

    Returns:
        The two losses.
    """
    fake = fake.detach()
    values = {}
    for name, condition in (
        ("map_discriminator", images.map),
        ("point_discriminator", images.points),
    ):
        network, optimizer = getattr(networks, name), networks.optimizers[name]
        loss = losses.discriminator_loss(
            network(condition, images.region), network(condition, fake)
        )
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        values[name] = loss.item()
    return values


def generator_step(
    networks: Networks,
    config: TrainingConfig,
    batch: Batch,
    images: Images,
    fake: Tensor,
    adversarial: bool,
) -> dict[str, float]:
    """Teach the generator.

    Args:
        networks: the weights of the generator change, those of the discriminators do not.
        config: weights of the losses.
        batch: tasks with their regions.
        images: the same as images.
        fake: the generator's images of the regions, with their graph.
        adversarial: whether the discriminators have a say in this step.

    Returns:
        The parts of the loss.
    """
    parts = {
        "pixel": losses.pixel_loss(fake, images.region),
        "segmentation": losses.segmentation_loss(
            region_probability(fake),
            batch.region,
            config.bce_weight,
            config.dice_weight,
            config.dice_smooth,
        ),
        "adversarial": fake.new_zeros(()),
    }
    judges = (networks.map_discriminator, networks.point_discriminator)
    if adversarial:
        # The judges pass gradients on to the image, but collect none for themselves.
        for judge in judges:
            judge.requires_grad_(False)
        parts["adversarial"] = losses.adversarial_loss(
            judges[0](images.map, fake)
        ) + losses.adversarial_loss(judges[1](images.points, fake))
    loss = losses.generator_loss(
        parts["adversarial"],
        parts["pixel"],
        parts["segmentation"],
        config.adversarial_weight,
        config.pixel_weight,
    )
    optimizer = networks.optimizers["generator"]
    optimizer.zero_grad()
    loss.backward()
    optimizer.step()
    for judge in judges:
        judge.requires_grad_(True)
    return {name: value.item() for name, value in parts.items()}


def learning_rate_factor(config: TrainingConfig, step: int, steps_per_epoch: int) -> float:
    """Share of the highest learning rate that a step runs at.

    Args:
        config: names the schedule.
        step: number of the step, from 0.
        steps_per_epoch: steps in one epoch.
    """
    if config.schedule == "exponential":
        return config.decay ** (step // steps_per_epoch)
    total = config.epochs * steps_per_epoch
    rising = config.warmup * total
    if step < rising:
        return (step + 1) / (rising + 1)
    return 0.5 * (1 + math.cos(math.pi * (step - rising) / (total - rising)))


def train(
    dataset: Dataset,
    config: TrainingConfig,
    output: str | PathLike[str],
    *,
    resume: bool = False,
    device: str = "auto",
    progress: bool = True,
) -> dict[str, Any]:
    """Train the three networks.

    After each epoch the folder holds ``last.pt`` (everything needed to go on), ``best.pt`` (the
    epoch with the highest region IoU on the validation tasks, the one to export) and ``log.jsonl``
    (one line an epoch). An interrupted run loses at most the epoch under way, and a resumed run
    gives the same weights as one that was never interrupted.

    Args:
        dataset: see :func:`cbagan_ompl.network.dataset.load_dataset`.
        config: the recipe.
        output: the folder for the files, made if missing.
        resume: go on from ``last.pt`` in that folder; without it the folder must hold none.
        device: ``auto`` (a GPU if there is one), ``cpu``, ``cuda``, ...
        progress: show a progress bar.

    Returns:
        ``validation`` and ``test`` scores of the best epoch, ``trivial`` scores of predictors that
        know nothing, on the test tasks, the ``epoch`` number and the path of the ``checkpoint``.

    Raises:
        ConfigError: ``resume`` with another recipe or data set, or without it although the folder
            holds a run.
        ModelError: a checkpoint that cannot be read.
    """
    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    place = pick_device(device)
    training, validation = dataset.split(config.validation_fraction, config.seed)
    networks = Networks(config, place)
    rng = np.random.default_rng(config.seed)
    noise_rng = torch.Generator().manual_seed(config.seed)
    history: list[dict[str, Any]] = []
    if resume:
        state = _load_state(folder / LAST, config, dataset)
        networks.load_state_dict(state["networks"])
        rng.bit_generator.state = json.loads(state["rng"])
        noise_rng.set_state(state["noise_rng"])
        history = state["history"]
    elif (folder / LAST).exists():
        raise ConfigError(
            f"{folder} holds a run already; resume it (--resume), or choose another folder"
        )

    for epoch in range(len(history), config.epochs):
        began = time.perf_counter()
        means = _train_epoch(networks, config, training, rng, noise_rng, epoch, progress)
        model = networks.average if config.ema_decay else networks.generator
        scores = evaluate(model, validation, place, config.batch_size)
        history.append(
            {
                "epoch": epoch + 1,
                "seconds": round(time.perf_counter() - began, 1),
                "losses": means,
                "validation": scores,
            }
        )
        state = {
            "schema": CHECKPOINT_SCHEMA,
            "config": config.to_dict(),
            "dataset": describe(dataset),
            "networks": networks.state_dict(),
            "rng": json.dumps(rng.bit_generator.state),
            "noise_rng": noise_rng.get_state(),
            "history": history,
        }
        if scores["iou"] == max(entry["validation"]["iou"] for entry in history):
            save_atomically(state, folder / BEST)
        save_atomically(state, folder / LAST)
        lines = "".join(json.dumps(entry) + "\n" for entry in history)
        (folder / LOG).write_text(lines, encoding="utf-8")
        if progress:
            tqdm.write(
                f"epoch {epoch + 1}/{config.epochs}: region IoU {scores['iou']:.3f}, "
                f"connectivity {scores['connectivity']:.1%}, {history[-1]['seconds']:.0f} s"
            )
    return _finish(folder, dataset, place, config)


def _train_epoch(
    networks: Networks,
    config: TrainingConfig,
    tasks: Tasks,
    rng: np.random.Generator,
    noise_rng: torch.Generator,
    epoch: int,
    progress: bool,
) -> dict[str, float]:
    """One pass over the tasks; means of the losses over the steps in which they were computed."""
    device = next(networks.generator.parameters()).device
    order = rng.permutation(len(tasks))
    # A last batch of one task would leave batch norm without a variance at the coarsest stage.
    steps = max(1, len(order) // config.batch_size)
    totals: dict[str, list[float]] = {}
    networks.generator.train()
    bar = tqdm(range(steps), desc=f"epoch {epoch + 1}", leave=False, disable=not progress)
    for i in bar:
        step = epoch * steps + i
        networks.set_learning_rates(learning_rate_factor(config, step, steps))
        batch = make_batch(
            tasks,
            order[i * config.batch_size : (i + 1) * config.batch_size],
            device,
            rng,
            symmetries=config.symmetries,
            reversal=config.reversal,
        )
        images = encode(batch)
        noise = torch.randn(batch.free.shape, generator=noise_rng).to(device)
        fake = networks.generator(images.map, images.points, noise)
        adversarial = step % config.adversarial_every == 0
        values = discriminator_step(networks, images, fake) if adversarial else {}
        values |= generator_step(networks, config, batch, images, fake, adversarial)
        networks.update_average(config.ema_decay, step)
        if not adversarial:
            del values["adversarial"]
        for name, value in values.items():
            totals.setdefault(name, []).append(value)
        bar.set_postfix(segmentation=f"{values['segmentation']:.3f}")
    return {name: float(np.mean(entries)) for name, entries in totals.items()}


def evaluate(
    generator: nn.Module, tasks: Tasks, device: torch.device, batch_size: int
) -> dict[str, float]:
    """Scores of a generator's regions, see :func:`cbagan_ompl.network.metrics.region_scores`."""
    predicted = np.concatenate(list(_predict(generator, tasks, device, batch_size)))
    return region_scores(predicted, tasks.region.astype(bool), tasks.free, tasks.start, tasks.goal)


@torch.inference_mode()
def _predict(
    generator: nn.Module, tasks: Tasks, device: torch.device, batch_size: int
) -> Iterator[NDArray[np.bool_]]:
    generator.eval()
    for first in range(0, len(tasks), batch_size):
        indices = np.arange(first, min(first + batch_size, len(tasks)))
        batch = make_batch(tasks, indices, device)
        images = encode(batch)
        image = generator(images.map, images.points, torch.zeros_like(batch.free))
        yield (region_probability(image)[:, 0] >= THRESHOLD).cpu().numpy()


def trivial_scores(tasks: Tasks) -> dict[str, dict[str, float]]:
    """Scores of two predictors that know nothing: all free space, and a straight band."""
    truth, free = tasks.region.astype(bool), tasks.free
    bands = np.zeros_like(tasks.region)
    for band, start, goal in zip(bands, tasks.start, tasks.goal, strict=True):
        ends = np.floor((start, goal)).astype(int).tolist()
        cv2.line(band, ends[0], ends[1], 1, thickness=2 * LINE_HALF_WIDTH + 1)
    return {
        "all free space": region_scores(free, truth, free, tasks.start, tasks.goal),
        "straight line": region_scores(
            bands.astype(bool) & free, truth, free, tasks.start, tasks.goal
        ),
    }


def describe(dataset: Dataset) -> dict[str, Any]:
    """What a record says about a training set."""
    return {
        "name": dataset.name,
        "maps": len(dataset.train.maps),
        "side": dataset.train.side,
        "train_tasks": len(dataset.train),
        "test_tasks": len(dataset.test),
    }


def pick_device(name: str) -> torch.device:
    """The device of a name; ``auto`` is a GPU if there is one.

    Raises:
        ConfigError: no such device.
    """
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError) as error:
        raise ConfigError(f"cannot use device {name!r}: {error}") from error
    return device


def save_atomically(state: dict[str, Any], path: Path) -> None:
    """Write a checkpoint so that a reader, or an interruption, never meets half a file."""
    temporary = path.with_suffix(".tmp")
    torch.save(state, temporary)
    os.replace(temporary, path)


def load_checkpoint(path: str | PathLike[str]) -> dict[str, Any]:
    """Read a file that :func:`train` wrote.

    Raises:
        ModelError: the file is missing, or no training checkpoint of this version.
    """
    source = Path(path)
    if not source.is_file():
        raise ModelError(f"{source}: no such file; `cbagan-ompl train` writes {LAST} and {BEST}")
    try:
        state = torch.load(source, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises many types for damaged and for foreign files
        raise ModelError(
            f"{source}: not a training checkpoint, or a damaged one ({type(error).__name__})"
        ) from error
    if not isinstance(state, dict) or state.get("schema") != CHECKPOINT_SCHEMA:
        raise ModelError(f"{source}: not a training checkpoint of this version of cbagan-ompl")
    return state


def _load_state(path: Path, config: TrainingConfig, dataset: Dataset) -> dict[str, Any]:
    state = load_checkpoint(path)
    saved, wanted = state["config"], config.to_dict()
    changed = [name for name in wanted if saved.get(name) != wanted[name]]
    if changed:
        raise ConfigError(
            f"{path} was written with other values of {', '.join(changed)}; "
            "resume with the recipe that the run began with"
        )
    if state["dataset"] != describe(dataset):
        raise ConfigError(f"{path} belongs to another data set: {state['dataset']}")
    return state


def _finish(
    folder: Path, dataset: Dataset, device: torch.device, config: TrainingConfig
) -> dict[str, Any]:
    """Score the best epoch on the test tasks and add the scores to its checkpoint."""
    best = load_checkpoint(folder / BEST)
    generator = best_generator(best).to(device)
    best["test"] = evaluate(generator, dataset.test, device, config.batch_size)
    best["trivial"] = trivial_scores(dataset.test)
    save_atomically(best, folder / BEST)
    return {
        "checkpoint": str(folder / BEST),
        "epoch": best["history"][-1]["epoch"],
        "validation": best["history"][-1]["validation"],
        "test": best["test"],
        "trivial": best["trivial"],
    }


def best_generator(state: dict[str, Any]) -> Generator:
    """The generator of a checkpoint that its epoch was validated with."""
    config = TrainingConfig().updated(state["config"])
    generator = make_generator(config)
    generator.load_state_dict(state["networks"]["average" if config.ema_decay else "generator"])
    return generator.eval()
