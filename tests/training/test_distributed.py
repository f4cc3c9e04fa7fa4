from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.tiny_model import TINY

torch = pytest.importorskip("torch")

from cbagan_ompl import ConfigError
from cbagan_ompl.training import loop
from cbagan_ompl.training.distributed import GlobalBatchNorm, ProcessGroup, pick_device

CPU = torch.device("cpu")


def test_unknown_device() -> None:
    with pytest.raises(ConfigError, match="nonsense"):
        pick_device("nonsense")


@pytest.mark.parametrize(
    ("name", "rank", "expected"), [("auto", "1", 1), ("cuda", "2", 2), ("cuda:0", "1", 0)]
)
def test_each_process_has_its_own_gpu(
    monkeypatch: pytest.MonkeyPatch, name: str, rank: str, expected: int
) -> None:
    placed, current = [], []
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "set_device", current.append)
    monkeypatch.setattr(torch, "empty", lambda *_, device: placed.append(device))
    monkeypatch.setenv("LOCAL_RANK", rank)
    device = pick_device(name)
    assert device == torch.device("cuda", expected)
    assert placed == current == [device]


def test_one_process_takes_the_first_gpu_or_the_cpu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LOCAL_RANK", raising=False)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert pick_device("auto") == CPU
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "set_device", lambda device: None)
    monkeypatch.setattr(torch, "empty", lambda *_, device: None)
    assert pick_device("auto") == torch.device("cuda", 0)


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
    assert loop._batch_size(tasks, TINY.updated({"batch_size": 32}), group) == size


def test_too_few_tasks_for_the_processes() -> None:
    with pytest.raises(ConfigError, match="4 processes cannot share 3 training tasks"):
        loop._batch_size(3, TINY, ProcessGroup(0, 4))


@pytest.mark.slow
def test_two_processes_have_the_gradients_of_one(folder: Path, tmp_path: Path) -> None:
    script = str(Path(__file__).parents[1] / "helpers" / "first_gradients.py")
    for processes in (1, 2):
        torchrun(processes, script, str(folder), str(tmp_path / f"{processes}.pt"))
    one, two = (torch.load(tmp_path / f"{n}.pt") for n in (1, 2))
    assert one.keys() == two.keys()
    for name in one:
        scale = one[name].abs().max().item()
        torch.testing.assert_close(two[name], one[name], rtol=0, atol=1e-4 * scale, msg=name)


@pytest.mark.slow
def test_training_under_torchrun(folder: Path, tmp_path: Path) -> None:
    words = ["--epochs", "1", "--device", "cpu", "--set", "widths=[4,4,6,8]", "batch_size=4"]
    words += ["discriminator_width=4", "adversarial_every=1"]
    for processes in (1, 2):
        run = ["train", str(folder), "--output", str(tmp_path / str(processes)), *words]
        torchrun(processes, "-m", "cbagan_ompl.cli", *run)
    logs = [json.loads((tmp_path / n / "log.jsonl").read_text()) for n in "12"]
    assert logs[1]["losses"] == pytest.approx(logs[0]["losses"], rel=1e-3)


@pytest.mark.slow
def test_batches_that_cannot_be_divided(folder: Path, tmp_path: Path) -> None:
    words = ["train", str(folder), "--output", str(tmp_path / "run"), "--device", "cpu"]
    with pytest.raises(AssertionError, match="batches of 5 cannot be shared evenly by 2 processes"):
        torchrun(2, "-m", "cbagan_ompl.cli", *words, "--set", "batch_size=5")
