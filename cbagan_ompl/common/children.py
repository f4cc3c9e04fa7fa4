"""Processes in which a worker of a cluster runs calls, so that what ends one leaves it alive.

A worker of Dask may not use :mod:`multiprocessing`: it is a daemon itself. A child of this module
ends when the worker does, however that ends, and takes the processes along that it has started.
"""

from __future__ import annotations

import os
import pickle
import signal
import socket
import subprocess
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pipe, active_children
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from typing import Any

from .parallel import ProcessDied

# Not -m, which would look for modules in the working directory first.
_CODE = (
    "import sys; sys.path[:] = sys.argv[2:]; "
    "from cbagan_ompl.common.children import serve; serve(int(sys.argv[1]))"
)

# Seconds that a child waits for its next call, and that it has to end.
_IDLE_S, _PATIENCE_S = 600, 5.0


@dataclass(frozen=True)
class Outcome:
    """How a call has ended.

    Attributes:
        result: what it returned.
        error: what it raised.
        details: the traceback of the error.
    """

    result: Any = None
    error: Exception | None = None
    details: str = ""


class Child:
    """A process that runs one call after the other."""

    def __init__(self) -> None:
        self._pipe, theirs = Pipe()
        with theirs:
            number = theirs.fileno()
            command = [sys.executable, "-c", _CODE, str(number), *sys.path]
            # What OMPL prints is of no use in the log of a worker.
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, pass_fds=[number]
            )

    @property
    def is_alive(self) -> bool:
        """Whether the process can take a call."""
        return self._process.poll() is None

    def run(self, call: bytes, shared: bytes) -> Outcome:
        """Return the outcome of a call.

        Args:
            call: pickle of a function and a tuple of arguments.
            shared: pickle of a tuple of arguments that come first.

        Raises:
            ProcessDied: the process has died.
        """
        try:
            self._pipe.send_bytes(shared)
            self._pipe.send_bytes(call)
            return pickle.loads(self._pipe.recv_bytes())  # type: ignore[no-any-return]
        except (OSError, EOFError) as error:
            raise ProcessDied(self._how_it_ended()) from error

    def _how_it_ended(self) -> str:
        self.close()
        code = self._process.returncode
        return f"ended by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"

    def give_up(self) -> None:
        """Let the process end, and whoever waits for its result get :class:`.ProcessDied`."""
        with socket.socket(fileno=os.dup(self._pipe.fileno())) as both_ends:
            both_ends.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End the process."""
        self._pipe.close()
        try:
            self._process.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Children:
    """The children of a worker, each used by one thread at a time."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._idle: list[Child] = []
        self._busy: dict[str, set[Child]] = {}

    def run(self, client: str, call: bytes, shared: bytes) -> Outcome:
        """Run a call in a child; arguments and errors as for :meth:`Child.run`.

        Args:
            client: whose call it is.
            call: see there.
            shared: see there.
        """
        with self._lock:
            idle = self._idle.pop() if self._idle else None
        if idle is None or not idle.is_alive:
            idle = Child()
        with self._lock:
            self._busy.setdefault(client, set()).add(idle)
        try:
            outcome = idle.run(call, shared)
            with self._lock:
                self._idle.append(idle)
            return outcome
        finally:
            with self._lock:
                self._busy[client].discard(idle)

    def end(self, client: str) -> None:
        """Give up the calls of a client, and end the children that have none."""
        with self._lock:
            idle, self._idle = self._idle, []
            for child in self._busy.pop(client, set()):
                child.give_up()
            self._busy[client] = set()
        for child in idle:
            child.close()


def serve(descriptor: int) -> None:
    """Run calls that come from a connection, until it is closed: the main function of a child.

    Args:
        descriptor: of the connection.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    pipe = Connection(descriptor)
    received: SimpleQueue[bytes] = SimpleQueue()
    Thread(target=_receive, args=(pipe, received), daemon=True).start()
    while True:
        try:
            shared = received.get(timeout=_IDLE_S)
        except Empty:
            return
        pipe.send_bytes(_run(received.get(), shared))


def _receive(pipe: Connection, received: SimpleQueue[bytes]) -> None:
    """Take in what comes, even during a call; at the end of it end this process."""
    try:
        while True:
            received.put(pipe.recv_bytes())
    except (OSError, EOFError):
        for process in active_children():
            process.kill()
        os._exit(0)


def _run(call: bytes, shared: bytes) -> bytes:
    try:
        work: Callable[..., Any]
        work, arguments = pickle.loads(call)
        return pickle.dumps(Outcome(work(*pickle.loads(shared), *arguments)))
    except Exception as error:
        return pickle.dumps(Outcome(error=error, details=traceback.format_exc()))
