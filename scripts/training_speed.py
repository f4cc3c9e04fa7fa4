"""How long a training step takes: memory format and precision, next to each other in one run.

    python scripts/training_speed.py [--device cuda] [--batch-size 32] [--threads 1]

The rows take turns, so that all of them meet the same disturbances. Ratios are to the first row.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import torch

from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.networks.factory import make_generator
from cbagan_ompl.training.distributed import pick_device

FORMATS = {"contiguous": torch.contiguous_format, "channels-last": torch.channels_last}


def step(
    generator: torch.nn.Module,
    inputs: tuple[torch.Tensor, ...],
    device: torch.device,
    precision: str,
) -> float:
    """Return the duration of one forward and backward pass, seconds."""
    began = time.perf_counter()
    with torch.autocast(device.type, torch.bfloat16, enabled=precision == "bfloat16"):
        image = generator(*inputs)
    image.float().square().mean().backward()
    if device.type == "cuda":
        torch.cuda.synchronize()
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", default="auto")
    parser.add_argument("--batch-size", type=int, default=32)
    parser.add_argument("--size", type=int, default=64, help="of the images, pixels")
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--threads", type=int, default=1, help="of the CPU")
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    device = pick_device(args.device)
    shape = (args.batch_size, 3, args.size, args.size)
    rows = {}
    for name, memory_format in FORMATS.items():
        generator = make_generator(NetworkConfig()).to(device, memory_format=memory_format)
        image = torch.rand(shape, device=device).contiguous(memory_format=memory_format)
        for precision in ("float32", "bfloat16"):
            inputs = (image, image, image[:, :1])
            rows[f"{name}, {precision}"] = (generator, inputs, device, precision)
    times: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(args.repeats + 1):
        for name, row in rows.items():
            times[name].append(step(*row))
    # The first round warms up.
    medians = {name: float(np.median(values[1:])) for name, values in times.items()}
    first = next(iter(medians.values()))
    for name, seconds in medians.items():
        print(f"{name:24} {1000 * seconds:8.1f} ms a step   {seconds / first:5.2f}")


if __name__ == "__main__":
    main()
