"""A model tried in a process of its own, which may crash, hang or run out of memory.

What a pickle says can be compared with the file (:mod:`.tensor_pickles`); what the code of a
TorchScript file does shows only when it runs.
"""

from __future__ import annotations

import hashlib
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable
from enum import Enum

from ..errors import ModelError

#: Time on a processor for loading and one prediction, and the memory for it beyond torch's own and
#: some copies of the file.
MAX_SECONDS, MAX_MEMORY = 2, 2**29
_COPIES = 3

# Against a machine that stands still: what a model may take is measured on the processor.
_PATIENCE_S = 60

# SHA-256 of what has been tried without harm; in the environment, for the processes of a benchmark.
_TRIED = "CBAGAN_OMPL_TRIED_MODELS"

# Not -m, which would look for modules in the working directory first.
_CODE = (
    "import sys; sys.path[:] = sys.argv[3:]; "
    "from cbagan_ompl.inference.probe import main; main(sys.argv[1], int(sys.argv[2]))"
)


class Kind(str, Enum):
    """What a module maps to what."""

    REGION = "region"
    ONNX = "onnx"
    INCEPTION = "inception"


def try_model(name: str, content: bytes, kind: Kind, size: int) -> None:
    """Load a module and run it once in another process, which takes about a second.

    Nothing is done for a content that this process, or the one that started it, has tried before.

    Args:
        name: of its file, for the message.
        content: an archive whose members have been checked: TorchScript or ONNX graphs.
        kind: of its input.
        size: height and width of its input.

    Raises:
        ModelError: the process crashed, took too long or too much memory, or raised an error.
    """
    digest = hashlib.sha256(f"{kind.value} {size} ".encode() + content).hexdigest()
    tried = os.environ.get(_TRIED, "").split()
    if digest in tried:
        return
    command = [sys.executable, "-I", "-c", _CODE, kind.value, str(size), *sys.path]
    try:
        done = subprocess.run(
            command,
            input=content,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            timeout=_PATIENCE_S,
            check=False,
        )
        status, said = done.returncode, done.stdout.decode("ascii", "replace").strip()
    except subprocess.TimeoutExpired:
        status, said = -signal.SIGXCPU, ""
    except (OSError, ValueError) as error:
        raise ModelError(
            f"{name}: models that no manifest.json lists are tried in another process first, and "
            f"that cannot be started ({error})"
        ) from error
    if status == 0:
        os.environ[_TRIED] = " ".join([*tried, digest])
        return
    if -status in (signal.SIGXCPU, signal.SIGKILL):
        reason = f"it takes more than {MAX_SECONDS} s for one prediction"
    elif status < 0:
        reason = f"a process that tried it was ended by {signal.Signals(-status).name}"
    else:
        reason = said or "the process that tried it gave no reason"
    raise ModelError(
        f"{name}: {'ONNX Runtime' if kind is Kind.ONNX else 'torch'} cannot load the model "
        f"({reason}), the file is probably damaged"
        f"{'' if kind is Kind.INCEPTION else '; copy or export it again'}"
    )


def main(kind: str, size: int) -> None:
    """Try the module on standard input: the other process.

    Args:
        kind: see :class:`Kind`.
        size: height and width of its input.
    """
    content = sys.stdin.buffer.read()
    run = _prepare(Kind(kind), content, size)
    _limit_resources(MAX_MEMORY + _COPIES * len(content))
    try:
        run()
    except Exception as error:  # torch raises many types for damaged archives
        print(str(error) if isinstance(error, ModelError) else type(error).__name__)
        sys.exit(1)


def _prepare(kind: Kind, content: bytes, size: int) -> Callable[[], object]:
    """Import what a module needs, and return what loads and runs it."""
    from .model_files import load_graphs, load_script
    from .predictor import Predictor

    record = {"working_size": size}
    if kind is Kind.ONNX:
        import onnxruntime  # noqa: F401

        return lambda: Predictor(load_graphs(content), record).warm_up()
    import torch

    torch.set_num_threads(1)
    if kind is Kind.REGION:
        return lambda: Predictor(load_script(content), record).warm_up()
    image = torch.zeros(1, 3, size, size, dtype=torch.uint8)

    def run() -> None:
        with torch.inference_mode():
            load_script(content)(image)

    return run


def _limit_resources(memory: int) -> None:
    """Limit what this process may take from now on; it leaves no memory dump when it crashes.

    Args:
        memory: beyond what it has, in bytes.
    """
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    spent = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    seconds = int(spent) + 1 + MAX_SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    try:
        with open("/proc/self/statm", encoding="ascii") as file:
            pages = int(file.read().split()[0])
    except OSError:
        return  # not Linux
    limit = pages * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
