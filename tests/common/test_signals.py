"""Ctrl-C and SIGTERM: raised once, held back where nothing may be cut through."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from cbagan_ompl.common.signals import (
    ENDING,
    Terminated,
    handle_endings,
    interrupts_held,
    raise_once,
)

INT, TERM = signal.SIGINT, signal.SIGTERM


@pytest.fixture
def raising() -> Iterator[None]:
    """Both signals raise, as in a command."""
    before = {number: signal.getsignal(number) for number in ENDING}
    for number in ENDING:
        signal.signal(number, raise_once)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def handlers() -> list[object]:
    return [signal.getsignal(number) for number in ENDING]


@pytest.mark.usefixtures("raising")
@pytest.mark.parametrize(("first", "error"), [(INT, KeyboardInterrupt), (TERM, Terminated)])
@pytest.mark.parametrize("second", [INT, TERM])
def test_only_the_first_signal_raises(
    first: signal.Signals, error: type[BaseException], second: signal.Signals
) -> None:
    with pytest.raises(KeyboardInterrupt) as caught:
        signal.raise_signal(first)
    assert type(caught.value) is error
    for _ in range(3):
        signal.raise_signal(second)
    assert handlers() == [signal.SIG_IGN] * 2


@pytest.mark.usefixtures("raising")
def test_ignored_signals_stay_ignored() -> None:
    signal.signal(INT, signal.SIG_IGN)
    handle_endings(raise_once)
    assert handlers() == [signal.SIG_IGN, raise_once]
    with interrupts_held() as came:
        os.kill(os.getpid(), INT)
        assert not came.poll(0.2), "a background job of a shell works on"
    assert handlers() == [signal.SIG_IGN, raise_once]


@pytest.mark.usefixtures("raising")
@pytest.mark.parametrize("default", [INT, TERM])
def test_signals_that_the_system_handles_stay_so(default: signal.Signals) -> None:
    signal.signal(default, signal.SIG_DFL)
    before = handlers()
    with interrupts_held():
        assert signal.getsignal(default) is signal.SIG_DFL
    assert handlers() == before


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


@pytest.mark.usefixtures("raising")
@pytest.mark.parametrize(("number", "error"), [(INT, KeyboardInterrupt), (TERM, Terminated)])
def test_the_first_of_several_held_signals_counts(
    number: signal.Signals, error: type[BaseException]
) -> None:
    done = []

    def block() -> None:
        with interrupts_held():
            for one in (number, INT, TERM, INT):
                signal.raise_signal(one)
            done.append(True)

    with pytest.raises(KeyboardInterrupt) as caught:
        block()
    assert type(caught.value) is error
    assert done == [True]


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("at", [1, 2])
def test_a_second_interrupt_while_handlers_are_set_back(
    monkeypatch: pytest.MonkeyPatch, at: int
) -> None:
    """Ctrl-C comes right after a handler is back, while the other one is not yet."""
    set_handler, calls = signal.signal, []

    def stop(number: int, frame: object) -> None:
        raise Terminated

    def interrupting(number: int, handler: object) -> object:
        before = set_handler(number, handler)
        if handler in (stop, signal.default_int_handler):
            calls.append(number)
            if len(calls) == at:
                signal.raise_signal(INT)
        return before

    def block() -> None:
        with interrupts_held():
            signal.raise_signal(INT)
            monkeypatch.setattr(signal, "signal", interrupting)

    before = set_handler(TERM, stop)
    try:
        with pytest.raises(KeyboardInterrupt):
            block()
        assert handlers() == [signal.default_int_handler, stop]
    finally:
        set_handler(TERM, before)


@pytest.mark.usefixtures("raising")
def test_blocks_in_blocks() -> None:
    done = []

    def block() -> None:
        with interrupts_held() as outer:
            with interrupts_held() as inner:
                signal.raise_signal(TERM)
                done.append(inner.poll() and not outer.poll())
            done.append(outer.poll())

    with pytest.raises(Terminated):
        block()
    assert done == [True, True]


@pytest.mark.usefixtures("raising")
def test_a_held_signal_comes_after_an_error_in_the_block() -> None:
    def block() -> None:
        with interrupts_held():
            signal.raise_signal(INT)
            raise ValueError("meanwhile")

    with pytest.raises(KeyboardInterrupt) as caught:
        block()
    assert isinstance(caught.value.__context__, ValueError)


@pytest.mark.usefixtures("raising")
def test_nothing_is_left_of_a_block() -> None:
    before, descriptors = handlers(), len(os.listdir("/proc/self/fd"))
    for _ in range(100):
        with interrupts_held() as came:
            assert not came.poll()
    assert handlers() == before
    assert len(os.listdir("/proc/self/fd")) == descriptors


def test_other_threads_have_no_interrupts_to_hold() -> None:
    def held() -> bool:
        with interrupts_held() as came:
            return came.poll()

    with ThreadPoolExecutor(1) as pool:
        assert not pool.submit(held).result()


# Cleans up for a second, and says so.
_COMMAND = """
import signal, sys, time
from cbagan_ompl.common.signals import Terminated, handle_endings, raise_once
handle_endings(raise_once)
try:
    print("ready", flush=True)
    time.sleep(60)
except KeyboardInterrupt as error:
    time.sleep(1)
    print("cleaned up", type(error).__name__)
"""


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(("number", "name"), [(INT, "KeyboardInterrupt"), (TERM, "Terminated")])
def test_signals_in_a_row_do_not_disturb_the_cleaning_up(number: int, name: str) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", _COMMAND], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        for _ in range(5):
            process.send_signal(number)
            time.sleep(0.05)
        printed, said = process.communicate(timeout=60)
    assert (process.returncode, printed, said) == (0, f"cleaned up {name}\n", "")
