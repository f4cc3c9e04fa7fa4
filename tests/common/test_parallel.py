from __future__ import annotations

import os
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import active_children
from multiprocessing.context import ForkServerProcess

import pytest

from cbagan_ompl import DatasetError
from cbagan_ompl.common.parallel import fork_server, run_all
from cbagan_ompl.common.signals import interrupts_held


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("other", [False, True], ids=["main-thread", "other-thread"])
def test_an_interrupt_comes_at_the_end_of_the_block(other: bool) -> None:
    over = threading.Event()
    thread = threading.Thread(target=over.wait, daemon=True)
    thread.start()
    taker = thread if other else threading.main_thread()
    passed = []

    def block() -> None:
        with interrupts_held() as came:
            signal.pthread_kill(taker.ident or 0, signal.SIGINT)
            # A wait would not end for a signal that another thread takes.
            passed.append(any(came.poll(0.01) for _ in range(6000)))

    with pytest.raises(KeyboardInterrupt):
        block()
    over.set()
    assert passed == [True]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.usefixtures("interruptible")
def test_an_ignored_interrupt_stays_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interrupts_held() as came:
        os.kill(os.getpid(), signal.SIGINT)
        assert not came.poll(0.2), "a background job of a shell works on"
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_other_threads_have_no_interrupts_to_hold() -> None:
    def held() -> bool:
        with interrupts_held() as came:
            return came.poll()

    with ThreadPoolExecutor(1) as pool:
        assert not pool.submit(held).result()


def test_processes_do_not_hear_interrupts() -> None:
    with interrupts_held():
        process = fork_server().Process(target=signal.raise_signal, args=(signal.SIGINT,))
        process.start()
    process.join()
    assert process.exitcode == 0


def test_a_process_that_dies() -> None:
    with pytest.raises(DatasetError, match="a process that worked on the maps has died"):
        run_all(os._exit, [(3,)], 1, "maps", progress=False)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_while_processes_start_leaves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    start, started = ForkServerProcess.start, []

    def interrupt_and_start(process: ForkServerProcess) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        start(process)
        started.append(process)

    monkeypatch.setattr(ForkServerProcess, "start", interrupt_and_start)
    with pytest.raises(KeyboardInterrupt):
        run_all(time.sleep, [(3600,), (3600,)], 2, "maps", progress=False)
    assert started
    assert not active_children()
