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
from numpy.typing import NDArray
from tqdm import tqdm

from ..common.files import as_path, make_folder, write_atomically
from ..common.memory import translate_lack_of_memory
from ..datasets.dataset import Tasks
from ..errors import ConfigError, show
from ..inference.model_files import translate_damage
from .batches import Batch, check_trainable, encode, make_batch, scale_down
from .checkpoints import SCHEMA, best_generator, load_checkpoint, save_checkpoint
from .config import BEST, LAST, TrainingConfig
from .distributed import ProcessGroup, pick_device, process_group
from .gan import Gan
from .model_weights import starting_weights
from .schedule import learning_rate_factor, plateau_factor
from .steps import adversarial_weights, discriminator_step, generator_step
from .task_sources import TaskSource
from .tensorboard import open_log, write_scalars
from .validation import evaluate, trivial_scores

LOG = "log.jsonl"


@dataclass
class Run:
    """Everything that changes during a run, and that a resumed run needs.

    Attributes:
        gan: weights and optimiser states.
        rng: random numbers of the order of the tasks and of their augmentation.
        noise_rng: of the noise; on the CPU, so that a run does not depend on the device.
        history: the entries of the log, one for each epoch.
    """

    gan: Gan
    rng: np.random.Generator
    noise_rng: torch.Generator
    history: list[dict[str, Any]] = field(default_factory=list)

    def state_dict(self) -> dict[str, Any]:
        """Return the run as a checkpoint holds it."""
        return {
            "gan": self.gan.state_dict(),
            "rng": json.dumps(self.rng.bit_generator.state),
            "noise_rng": self.noise_rng.get_state(),
            "history": self.history,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what :meth:`state_dict` returned."""
        self.gan.load_state_dict(state["gan"])
        self.rng.bit_generator.state = json.loads(state["rng"])
        self.noise_rng.set_state(state["noise_rng"])
        self.history = state["history"]


def train(
    source: TaskSource,
    config: TrainingConfig,
    output: str | PathLike[str],
    *,
    resume: bool = False,
    start_from: str | PathLike[str] | None = None,
    device: str = "auto",
    progress: bool = True,
    tensorboard: bool = False,
) -> dict[str, Any]:
    """Train the generator, against two discriminators unless their weight is 0.

    After each epoch the folder holds ``last.pt`` (everything needed to resume), ``best.pt`` (the
    epoch with the highest region IoU on the validation tasks, the one to export) and ``log.jsonl``
    (one line for each epoch). An interrupted run loses at most the current epoch, and a resumed
    run gives the same weights as one that was never interrupted. Under ``torchrun`` each process
    trains on its shard of each batch, and the first one writes the files.

    Args:
        source: of the tasks, see :mod:`cbagan_ompl.training.task_sources`.
        config: the recipe.
        output: the folder for the files, made if missing.
        resume: go on from ``last.pt`` in that folder, or begin where a run ended before its first
            epoch; without it the folder must hold no run. The recipe may ask for more epochs than
            the run began with: from there on the learning rates are those of the longer run.
        start_from: checkpoint of another run of the same networks, or an exported model (a file
            or the name of a bundled one), whose weights this run begins with. Discriminators are
            in checkpoints alone.
        device: ``auto`` (a GPU if there is one), ``cpu``, ``cuda``, ...
        progress: show a progress bar.
        tensorboard: write losses and scores for TensorBoard into the folder as well.

    Returns:
        ``validation`` and ``test`` scores of the best epoch, ``trivial`` scores of the trivial
        baselines on the test tasks, the ``epoch`` number and the path of the ``checkpoint``.

    Raises:
        ConfigError: ``resume`` with another recipe or other tasks, or without it although the
            folder holds a run; ``start_from`` with other networks; the folder cannot be made; no
            such device; the loss is not finite; the processes cannot share a batch evenly; or
            there is not enough memory.
        DatasetError: the images are of a size that the networks cannot take.
        MissingDependencyError: ``tensorboard`` without the package of that name.
        ModelError: a checkpoint that cannot be read or written.
    """
    folder, target = as_path(output), pick_device(device)
    check_trainable(source.size, config)
    task = f"to train on batches of {config.batch_size} images of {source.size} pixels"
    cure = "lower batch_size (--set batch_size=N), or train smaller networks"
    with translate_lack_of_memory(ConfigError, task, cure), process_group(target) as group:
        if config.batch_size % group.size:
            raise ConfigError(
                f"batches of {config.batch_size} cannot be shared evenly by {group.size} processes"
            )
        resume = group.from_leader(_prepare_folder(folder, resume) if group.is_leader else None)
        run = _start_run(config, target, group, None if resume else start_from, source)
        if resume:
            state = _load_matching(folder / LAST, config, source) if group.is_leader else None
            state = group.from_leader(state)
            with translate_damage(folder / LAST, "damaged, its weights do not fit its networks"):
                run.load_state_dict(state)
        _run_epochs(run, config, source, folder, target, progress, tensorboard)
        return group.from_leader(
            _finish(folder, source, target, config) if group.is_leader else None
        )


def _prepare_folder(folder: Path, resume: bool) -> bool:
    """Make the folder of a run; return whether it holds one to go on from."""
    if not resume:
        for name in (LAST, BEST, LOG):
            if (folder / name).exists():
                raise ConfigError(
                    f"{folder} holds a run already, or another {name}; resume the run (--resume), "
                    "or choose another folder"
                )
    make_folder(folder)
    return resume and (folder / LAST).exists()


def _start_run(
    config: TrainingConfig,
    device: torch.device,
    group: ProcessGroup,
    start_from: str | PathLike[str] | None,
    source: TaskSource,
) -> Run:
    run = Run(
        Gan(config, device, group),
        np.random.default_rng(config.seed),
        torch.Generator().manual_seed(config.seed),
    )
    if start_from is not None:
        run.gan.start_from(starting_weights(start_from, source.validation))
    return run


def _run_epochs(
    run: Run,
    config: TrainingConfig,
    source: TaskSource,
    folder: Path,
    device: torch.device,
    progress: bool,
    tensorboard: bool,
) -> None:
    """Train until all epochs are done; the leading process reports and writes files."""
    leads = run.gan.group.is_leader
    progress = progress and leads
    if progress:
        for name, scores in trivial_scores(source.validation).items():
            print(f"for comparison, {name}: {_summarize(scores)}")
    log = open_log(folder, len(run.history)) if tensorboard and leads else None
    for epoch in range(len(run.history), config.epochs):
        entry = _run_epoch(run, config, source, device, epoch, progress)
        run.history.append(entry)
        if leads:
            _save(run, config, source, folder)
            if log is not None:
                write_scalars(log, entry)
        if progress:
            scores, seconds = entry["validation"], entry["seconds"]
            print(f"epoch {epoch + 1}/{config.epochs}: {_summarize(scores)}, {seconds:.0f} s")


def _run_epoch(
    run: Run,
    config: TrainingConfig,
    source: TaskSource,
    device: torch.device,
    epoch: int,
    progress: bool,
) -> dict[str, Any]:
    """Train for one pass over the tasks, validate, and return the entry of the log."""
    began = time.perf_counter()
    means = _train_epoch(run, config, source.epoch(epoch), device, epoch, progress)
    gan = run.gan
    generator = gan.average if config.ema_decay else gan.generator
    scores = gan.group.from_leader(
        evaluate(generator, source.validation, device, config.batch_size)
        if gan.group.is_leader
        else None
    )
    seconds = round(time.perf_counter() - began, 1)
    return {"epoch": epoch + 1, "seconds": seconds, "losses": means, "validation": scores}


def _train_epoch(
    run: Run,
    config: TrainingConfig,
    tasks: Tasks,
    device: torch.device,
    epoch: int,
    progress: bool,
) -> dict[str, float]:
    """Return the means of the losses over the steps in which they were computed."""
    order = run.rng.permutation(len(tasks))
    size = _batch_size(len(order), config, run.gan.group)
    # The tasks that fill no batch wait for the next epoch, which has another order.
    steps = len(order) // size
    plateau = plateau_factor(config, [entry["validation"]["iou"] for entry in run.history])
    totals: dict[str, list[float]] = {}
    run.gan.generator.train()
    bar = tqdm(range(steps), desc=f"epoch {epoch + 1}", leave=False, disable=not progress)
    for i in bar:
        step = epoch * steps + i
        run.gan.set_learning_rates(plateau * learning_rate_factor(config, step, steps))
        indices = order[i * size : (i + 1) * size]
        values = _step(run, config, tasks, indices, device, step)
        if not all(math.isfinite(value) for value in values.values()):
            raise ConfigError(
                f"the loss is not finite in epoch {epoch + 1}; lower the learning rates"
            )
        run.gan.update_average(config.ema_decay, step)
        for name, value in values.items():
            totals.setdefault(name, []).append(value)
        bar.set_postfix(segmentation=f"{values['segmentation']:.3f}")
    return {name: float(np.mean(entries)) for name, entries in totals.items()}


def _batch_size(tasks: int, config: TrainingConfig, group: ProcessGroup) -> int:
    """Return the number of tasks in a batch: with few tasks, as many as divide evenly."""
    size = min(tasks, config.batch_size)
    size -= size % group.size
    if size == 0:
        raise ConfigError(f"{group.size} processes cannot share {tasks} training tasks")
    return size


def _step(
    run: Run,
    config: TrainingConfig,
    tasks: Tasks,
    indices: NDArray[np.int64],
    device: torch.device,
    step: int,
) -> dict[str, float]:
    """Train the networks with one batch, or this process's shard of it; return the losses."""
    gan = run.gan
    batch = make_batch(
        tasks,
        indices,
        device,
        run.rng,
        symmetries=config.symmetries,
        reversal=config.reversal,
    )
    if len(config.scales) > 1:
        batch = scale_down(batch, int(run.rng.choice(config.scales)))
    noise = torch.randn(batch.free.shape, generator=run.noise_rng).to(device)
    shard = gan.group.shard
    batch, noise = Batch(*map(shard, vars(batch).values())), shard(noise)
    images = encode(batch)
    painted = gan.generate(images.map, images.points, noise)
    if not config.adversarial_weight or step % config.adversarial_every:
        return generator_step(gan, config, batch, images, painted, None)
    errors = discriminator_step(gan, images, painted.image)
    weights = adversarial_weights(config, errors)
    return errors | generator_step(gan, config, batch, images, painted, weights)


def _save(run: Run, config: TrainingConfig, source: TaskSource, folder: Path) -> None:
    state = {
        "schema": SCHEMA,
        "config": config.to_dict(),
        "dataset": source.description(),
        **run.state_dict(),
    }
    ious = [entry["validation"]["iou"] for entry in run.history]
    if ious[-1] == max(ious):
        save_checkpoint(state, folder / BEST)
    save_checkpoint(state, folder / LAST)
    write_atomically(folder / LOG, "".join(json.dumps(entry) + "\n" for entry in run.history))


def _load_matching(path: Path, config: TrainingConfig, source: TaskSource) -> dict[str, Any]:
    """Return the checkpoint to resume from, which must have the same recipe and tasks."""
    state = load_checkpoint(path)
    # Options that earlier versions did not have are at their defaults.
    saved, wanted = TrainingConfig().to_dict() | state["config"], config.to_dict()
    changed = [name for name in wanted if name != "epochs" and saved[name] != wanted[name]]
    if changed:
        raise ConfigError(
            f"{path} was written with other values of {', '.join(changed)}; "
            "resume with the recipe that the run began with"
        )
    if config.epochs < len(state["history"]):
        raise ConfigError(
            f"{path} has {len(state['history'])} epochs behind it, more than the {config.epochs} "
            "asked for"
        )
    if state["dataset"] != source.description():
        raise ConfigError(f"{path} belongs to another data set: {show(state['dataset'])}")
    return state


def _finish(
    folder: Path, source: TaskSource, device: torch.device, config: TrainingConfig
) -> dict[str, Any]:
    """Score the best epoch on the test tasks and add the scores to its checkpoint."""
    best = load_checkpoint(folder / BEST)
    generator = best_generator(best, folder / BEST).to(device)
    best["test"] = evaluate(generator, source.test, device, config.batch_size)
    best["trivial"] = trivial_scores(source.test)
    save_checkpoint(best, folder / BEST)
    return {
        "checkpoint": str(folder / BEST),
        "epoch": best["history"][-1]["epoch"],
        "validation": best["history"][-1]["validation"],
        "test": best["test"],
        "trivial": best["trivial"],
    }


def _summarize(scores: dict[str, float]) -> str:
    return (
        f"region IoU {scores['iou']:.3f}, Dice {scores['dice']:.3f}, "
        f"connected (8) {scores['connectivity']:.1%}"
    )
