"""The same work on many things, in several processes, with a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children
from typing import Any, TypeVar

from tqdm import tqdm

from ..errors import DatasetError
from ..processes import fork_server, interrupts_held

T = TypeVar("T")


def run_all(
    work: Callable[..., T],
    arguments: Sequence[tuple[Any, ...]],
    processes: int,
    unit: str,
    progress: bool = True,
) -> list[T]:
    """Results of ``work(*args)`` for each of the arguments, in their order.

    Args:
        work: a function of a module.
        arguments: of each call.
        processes: at a time.
        unit: what the progress bar counts.
        progress: show the progress bar.

    Raises:
        KeyboardInterrupt: after an interrupt; calls that have begun are given up.
        DatasetError: a process has died.
        Exception: what a call raised.
    """
    results: dict[int, T] = {}
    others = set(active_children())
    with interrupts_held():
        context = fork_server()
    with ProcessPoolExecutor(processes, context) as pool:
        try:
            with interrupts_held():  # submitting starts the processes
                places = {pool.submit(work, *args): i for i, args in enumerate(arguments)}
            done = as_completed(places)
            for future in tqdm(done, total=len(places), unit=f" {unit}", disable=not progress):
                results[places[future]] = future.result()
        except BrokenProcessPool as error:
            raise DatasetError(
                f"a process that worked on the {unit} has died, perhaps for lack of memory"
            ) from error
        except BaseException:
            for child in set(active_children()) - others:
                child.terminate()
            pool.shutdown(cancel_futures=True)
            raise
    return [results[i] for i in range(len(arguments))]
