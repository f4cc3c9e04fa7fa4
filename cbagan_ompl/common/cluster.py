"""Calls on the workers of a `Dask <https://distributed.dask.org>`_ cluster.

A worker runs each call in a child process (:mod:`.children`), which OMPL can abort without harm to
the worker. The scheduler repeats a call once whose child has died, perhaps on another worker, and
gives the calls of a worker that is gone to the others.
"""

from __future__ import annotations

import json
import logging
import os
import pickle
import warnings
from collections.abc import Callable, Generator, Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import ClusterError, show
from .children import Children, Outcome
from .files import read_text, reason
from .parallel import ProcessDeath, ProcessDied
from .validation import positive_number, require
from .versions import versions

if TYPE_CHECKING:
    from distributed import Client, Future

T = TypeVar("T")

#: Seconds in which a scheduler must answer, and in which a worker must be there.
TIMEOUT_S = 20.0

# Seconds between two looks for workers that are gone, and for a cluster to answer at the end.
_POLL_S, _PATIENCE_S = 1.0, 5.0

# A file that "dask scheduler --scheduler-file" wrote has at most so many bytes.
_MAX_FILE = 2**20

_START = "start it with: dask scheduler, and workers with: dask worker ADDRESS"


class ClusterExecutor:
    """The workers of a Dask cluster, as a context manager.

    Everything that a scheduler and its workers send is unpickled, and so can run code: connect to
    clusters that you trust alone.

    Args:
        address: of the scheduler, ``tcp://HOST:PORT``, or the file that ``dask scheduler
            --scheduler-file`` wrote.
        timeout: seconds in which the scheduler must answer, and a worker must be there.

    Raises:
        MissingDependencyError: Dask is not installed.
        ConfigError: ``timeout`` is no positive number.
        ClusterError: the scheduler does not answer, has no worker, or a worker lacks this package
            or has other versions.
    """

    def __init__(self, address: str, timeout: float = TIMEOUT_S) -> None:
        require("distributed", "cluster")
        self._timeout = positive_number("timeout", timeout)
        self._address = _read_address(address)
        for logger in ("distributed", "distributed.client", "tornado.application"):
            logging.getLogger(logger).setLevel(logging.CRITICAL)  # what matters is raised
        self._client = self._connect()
        try:
            self._check_workers()
        except BaseException:
            self._client.close(_PATIENCE_S)
            raise

    def __enter__(self) -> ClusterExecutor:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(Exception):  # the cluster may be gone, which was said before
            self._client.run(_end_calls, self._client.id, on_error="ignore")
        self._client.close(_PATIENCE_S)

    def completed(
        self,
        work: Callable[..., T],
        calls: Mapping[str, tuple[Any, ...]],
        shared: tuple[Any, ...] = (),
    ) -> Generator[tuple[str, T | ProcessDeath], None, None]:
        """Yield the results of calls, see :meth:`.parallel.Executor.completed`."""
        done: SimpleQueue[Future[Outcome]] = SimpleQueue()
        running: dict[Future[Outcome], str] = {}
        waiting = iter(calls.items())
        # The result of a call, since the scheduler makes one that is lost again.
        first = self._submit(_hand_on, _dump(shared))
        try:
            while True:
                # No more than can run: the scheduler holds all calls that a worker has against
                # them when it dies.
                places = (self._threads() or 1) - len(running)
                for name, arguments in islice(waiting, max(places, 0)):
                    call = _dump((work, arguments))
                    future = self._submit(_run_call, self._client.id, versions(), call, first)
                    running[future] = name
                    future.add_done_callback(done.put)
                if not running:
                    return
                future = self._wait(done)
                yield running.pop(future), self._result(future)
                future.release()
        finally:
            self._give_up(list(running))

    def _connect(self) -> Client:
        from distributed import Client

        try:
            return Client(self._address, timeout=self._timeout, set_as_default=False)
        except Exception as error:  # OSError, ValueError and others for an odd address
            raise ClusterError(
                f"no scheduler answers at {show(self._address)} within {self._timeout:g} s "
                f"({reason(error) or type(error).__name__}); {_START}"
            ) from error

    def _check_workers(self) -> None:
        try:
            self._client.wait_for_workers(1, timeout=self._timeout)
        except Exception as error:
            raise ClusterError(
                f"the scheduler at {self._address} has no worker; start some with: dask worker "
                f"{self._address}"
            ) from error
        answers = self._client.run(versions, on_error="return")
        try:
            answers["the scheduler"] = self._client.run_on_scheduler(versions)
        except Exception as error:
            answers["the scheduler"] = error
        for where, found in answers.items():
            _check_versions(where, found)

    def _submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        try:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Sending large graph")  # models are large
                return self._client.submit(function, *arguments, pure=False, retries=1)
        except Exception as error:
            raise self._gone() from error

    def _gone(self) -> ClusterError:
        return ClusterError(f"the scheduler at {self._address} is gone; what was finished is kept")

    def _threads(self) -> int | None:
        """Return how many calls can run now, None where the scheduler does not answer."""
        try:
            threads: int = sum(self._client.nthreads().values())
            return threads
        except Exception:  # the futures are cancelled then
            return None

    def _wait(self, done: SimpleQueue[Future[Outcome]]) -> Future[Outcome]:
        """Return a future that is done; raise if there has been no worker for a while."""
        last = monotonic()
        while True:
            try:
                return done.get(timeout=_POLL_S)
            except Empty:
                if self._threads() != 0:
                    last = monotonic()
                elif monotonic() > last + self._timeout:
                    raise ClusterError(
                        f"the scheduler at {self._address} has lost its last worker; what was "
                        "finished is kept"
                    ) from None

    def _result(self, future: Future[Outcome]) -> Any:
        from distributed import KilledWorker

        if future.status in ("cancelled", "lost"):
            raise self._gone()
        try:
            outcome = future.result()
        except ProcessDied as death:
            return ProcessDeath(str(death))
        except KilledWorker as death:
            return ProcessDeath(f"the workers that ran it have died ({death.last_worker})")
        except Exception as error:
            raise ClusterError(
                f"a worker cannot run a call ({type(error).__name__}: {error}); it needs the same "
                "packages as this machine"
            ) from error
        if outcome.error is not None:
            raise outcome.error from RuntimeError(outcome.details)
        return outcome.result

    def _give_up(self, unfinished: list[Future[Outcome]]) -> None:
        if unfinished:
            with suppress(Exception):  # the cluster may be gone, which is said already
                self._client.cancel(unfinished, force=True)
                self._client.run(_end_calls, self._client.id, on_error="ignore")


def _dump(value: object) -> bytes:
    """Return a pickle: what a scheduler and a worker hand on is not theirs to load."""
    return pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)


def _read_address(address: str) -> str:
    if not os.path.isfile(address):
        return address
    try:
        return str(json.loads(read_text(Path(address), ClusterError, _MAX_FILE))["address"])
    except Exception as error:
        raise ClusterError(
            f"{address} is no file that dask scheduler --scheduler-file wrote ({reason(error)})"
        ) from error


def _check_versions(where: str, found: object) -> None:
    ours = versions()
    if isinstance(found, Exception):
        raise ClusterError(
            f"{where} cannot load cbagan-ompl ({type(found).__name__}: {found}); install there "
            "what is installed here"
        )
    assert isinstance(found, dict)
    other = [f"{name} {found.get(name)}" for name in ours if found.get(name) != ours[name]]
    if other:
        here = ", ".join(f"{name} {value}" for name, value in ours.items())
        raise ClusterError(
            f"{where} has {', '.join(other)}, here are {here}: results would differ; install the "
            "same versions everywhere"
        )


# What follows runs on a worker, or in the scheduler.

_children = Children()


def _hand_on(data: bytes) -> bytes:
    return data


def _run_call(client: str, wanted: dict[str, str], call: bytes, shared: bytes) -> Outcome:
    found = versions()
    if found != wanted:  # a worker that came after the others were checked
        return Outcome(error=ClusterError(f"a worker has {found}, where {wanted} is wanted"))
    outcome = _children.run(client, call, shared)
    if isinstance(outcome.error, ProcessDied):
        raise outcome.error  # which the scheduler counts as a death
    return outcome


def _end_calls(client: str) -> None:
    _children.end(client)
