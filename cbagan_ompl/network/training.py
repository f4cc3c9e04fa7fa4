"""The training loop: discriminator step, generator step, validation, checkpoint."""

from __future__ import annotations

import json
import math
import time
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from ..errors import ConfigError
from . import losses
from .checkpoints import BEST, LAST, SCHEMA, best_generator, load_checkpoint, save_atomically
from .config import TrainingConfig
from .dataset import Batch, Dataset, Tasks, make_batch
from .encoding import region_probability
from .evaluation import evaluate, trivial_scores
from .networks import Images, Networks, encode, pick_device

LOG = "log.jsonl"


@dataclass
class Run:
    """Everything that changes while a run goes on, and that a resumed run needs.

    Attributes:
        networks: weights and optimiser states.
        rng: draws the order of the tasks and their augmentation.
        noise_rng: draws the noise; on the CPU, so that a run does not depend on the device.
        history: what the log says, one entry an epoch.
    """

    networks: Networks
    rng: np.random.Generator
    noise_rng: torch.Generator
    history: list[dict[str, Any]] = field(default_factory=list)

    def state_dict(self) -> dict[str, Any]:
        """The run as a checkpoint holds it."""
        return {
            "networks": self.networks.state_dict(),
            "rng": json.dumps(self.rng.bit_generator.state),
            "noise_rng": self.noise_rng.get_state(),
            "history": self.history,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """The inverse of :meth:`state_dict`."""
        self.networks.load_state_dict(state["networks"])
        self.rng.bit_generator.state = json.loads(state["rng"])
        self.noise_rng.set_state(state["noise_rng"])
        self.history = state["history"]


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
        loss.backward()  # type: ignore[no-untyped-call]
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
        parts.get("adversarial", fake.new_zeros(())),
        parts["pixel"],
        parts["segmentation"],
        config.adversarial_weight,
        config.pixel_weight,
    )
    optimizer = networks.optimizers["generator"]
    optimizer.zero_grad()
    loss.backward()  # type: ignore[no-untyped-call]
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
            holds a run; the folder cannot be made; no such device; or the loss is not finite.
        ModelError: a checkpoint that cannot be read.
    """
    folder = Path(output)
    place = pick_device(device)
    training, validation = dataset.split(config.validation_fraction, config.seed)
    run = Run(
        Networks(config, place),
        np.random.default_rng(config.seed),
        torch.Generator().manual_seed(config.seed),
    )
    if resume:
        run.load_state_dict(_matching_checkpoint(folder / LAST, config, dataset))
    elif (folder / LAST).exists():
        raise ConfigError(
            f"{folder} holds a run already; resume it (--resume), or choose another folder"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"cannot make the folder {folder}: {error.strerror or error}") from error
    if progress:
        for name, scores in trivial_scores(validation).items():
            print(f"for comparison, {name}: {_summary(scores)}")

    model = run.networks.average if config.ema_decay else run.networks.generator
    for epoch in range(len(run.history), config.epochs):
        began = time.perf_counter()
        means = _train_epoch(run, config, training, place, epoch, progress)
        scores = evaluate(model, validation, place, config.batch_size)
        seconds = round(time.perf_counter() - began, 1)
        run.history.append(
            {"epoch": epoch + 1, "seconds": seconds, "losses": means, "validation": scores}
        )
        _save(run, config, dataset, folder)
        if progress:
            print(f"epoch {epoch + 1}/{config.epochs}: {_summary(scores)}, {seconds:.0f} s")
    return _finish(folder, dataset, place, config)


def _train_epoch(
    run: Run,
    config: TrainingConfig,
    tasks: Tasks,
    device: torch.device,
    epoch: int,
    progress: bool,
) -> dict[str, float]:
    """One pass over the tasks; means of the losses over the steps in which they were computed."""
    order = run.rng.permutation(len(tasks))
    # The tasks that fill no batch wait for the next epoch, which has another order.
    steps = max(1, len(order) // config.batch_size)
    totals: dict[str, list[float]] = {}
    run.networks.generator.train()
    bar = tqdm(range(steps), desc=f"epoch {epoch + 1}", leave=False, disable=not progress)
    for i in bar:
        step = epoch * steps + i
        run.networks.set_learning_rates(learning_rate_factor(config, step, steps))
        batch = make_batch(
            tasks,
            order[i * config.batch_size : (i + 1) * config.batch_size],
            device,
            run.rng,
            symmetries=config.symmetries,
            reversal=config.reversal,
        )
        images = encode(batch)
        noise = torch.randn(batch.free.shape, generator=run.noise_rng).to(device)
        fake = run.networks.generator(images.map, images.points, noise)
        adversarial = step % config.adversarial_every == 0
        values = discriminator_step(run.networks, images, fake) if adversarial else {}
        values |= generator_step(run.networks, config, batch, images, fake, adversarial)
        if not all(math.isfinite(value) for value in values.values()):
            raise ConfigError(
                f"the loss is not finite in epoch {epoch + 1}; lower the learning rates"
            )
        run.networks.update_average(config.ema_decay, step)
        for name, value in values.items():
            totals.setdefault(name, []).append(value)
        bar.set_postfix(segmentation=f"{values['segmentation']:.3f}")
    return {name: float(np.mean(entries)) for name, entries in totals.items()}


def _save(run: Run, config: TrainingConfig, dataset: Dataset, folder: Path) -> None:
    state = {
        "schema": SCHEMA,
        "config": config.to_dict(),
        "dataset": dataset.description(),
        **run.state_dict(),
    }
    ious = [entry["validation"]["iou"] for entry in run.history]
    if ious[-1] == max(ious):
        save_atomically(state, folder / BEST)
    save_atomically(state, folder / LAST)
    lines = "".join(json.dumps(entry) + "\n" for entry in run.history)
    (folder / LOG).write_text(lines, encoding="utf-8")


def _matching_checkpoint(path: Path, config: TrainingConfig, dataset: Dataset) -> dict[str, Any]:
    state = load_checkpoint(path)
    saved, wanted = state["config"], config.to_dict()
    changed = [name for name in wanted if saved.get(name) != wanted[name]]
    if changed:
        raise ConfigError(
            f"{path} was written with other values of {', '.join(changed)}; "
            "resume with the recipe that the run began with"
        )
    if state["dataset"] != dataset.description():
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


def _summary(scores: dict[str, float]) -> str:
    return (
        f"region IoU {scores['iou']:.3f}, Dice {scores['dice']:.3f}, "
        f"connectivity {scores['connectivity']:.1%}"
    )
