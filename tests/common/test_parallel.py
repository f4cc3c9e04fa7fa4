from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from multiprocessing import active_children
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import pytest

from cbagan_ompl import DatasetError
from cbagan_ompl.common.parallel import LocalExecutor, fork_server, run_all
from cbagan_ompl.common.signals import interrupts_held


def test_processes_do_not_hear_interrupts() -> None:
    with interrupts_held():
        process = fork_server().Process(target=signal.raise_signal, args=(signal.SIGINT,))
        process.start()
    process.join()
    assert process.exitcode == 0


def test_a_process_that_dies() -> None:
    with pytest.raises(DatasetError, match="a process that worked on the maps has died"):
        run_all(os._exit, {"map_0": (3,)}, LocalExecutor(1), "maps", progress=False)


def test_a_script_without_a_guard_is_told_so(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import time\n"
        "from cbagan_ompl.common.parallel import LocalExecutor, run_all\n"
        "run_all(time.sleep, {'a': (0,)}, LocalExecutor(1), 'maps', progress=False)\n"
    )
    command = [sys.executable, str(script)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert done.stderr.count("cbagan_ompl.errors.DatasetError") == 1
    said = done.stderr.splitlines()[-1]
    assert f"has died, since {script} starts it, and each process imports that script" in said
    assert said.endswith('call that under `if __name__ == "__main__":`')


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_while_processes_start_leaves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    start, started = ForkServerProcess.start, []

    def interrupt_and_start(process: ForkServerProcess) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        start(process)
        started.append(process)

    monkeypatch.setattr(ForkServerProcess, "start", interrupt_and_start)
    calls = {"map_0": (3600,), "map_1": (3600,)}
    with pytest.raises(KeyboardInterrupt):
        run_all(time.sleep, calls, LocalExecutor(2), "maps", progress=False)
    assert started
    assert not active_children()
