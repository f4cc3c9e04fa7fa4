"""Calls on a real scheduler and workers, processes of this machine."""

from __future__ import annotations

import operator
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

pytest.importorskip("distributed")

from helpers.cluster_calls import die, end_worker
from helpers.clusters import Cluster, cluster_of

from cbagan_ompl import ClusterError, ConfigError, DatasetError, MissingDependencyError
from cbagan_ompl.common.cluster import ClusterExecutor
from cbagan_ompl.common.parallel import ProcessDeath, run_all, run_each
from cbagan_ompl.common.versions import versions


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with cluster_of(tmp_path_factory.mktemp("cluster"), workers=1) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def executor(cluster: Cluster) -> Iterator[ClusterExecutor]:
    with ClusterExecutor(str(cluster.file)) as executor:
        yield executor


def test_results_come_in_the_order_of_the_calls(executor: ClusterExecutor) -> None:
    calls = {str(n): (n,) for n in range(30)}
    assert run_all(pow, calls, executor, "powers", False, shared=(2,)) == [2**n for n in range(30)]
    assert run_all(pow, {}, executor, "powers", False) == []


def test_errors_of_calls_are_raised_here(executor: ClusterExecutor) -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        run_all(operator.truediv, {"ratio": (3, 0)}, executor, "ratios", False)
    assert "children.py" in str(caught.value.__cause__)


def test_a_process_that_dies_costs_one_retry(executor: ClusterExecutor, tmp_path: Path) -> None:
    calls = {"map_0": (tmp_path / "once", 1)}
    assert run_all(die, calls, executor, "maps", False) == ["done"]
    assert (tmp_path / "once").read_bytes() == b".."


def test_what_dies_twice_is_reported_and_nothing_else_is_lost(
    executor: ClusterExecutor, tmp_path: Path
) -> None:
    calls = {f"map_{n}": (tmp_path / str(n), 99 if n == 1 else 0) for n in range(4)}
    finished: dict[str, str] = {}
    with pytest.raises(DatasetError, match=r"1 of 4 maps are missing.*map_1: ended by SIGABRT"):
        run_each(die, calls, executor, finished.__setitem__, "maps", False)
    assert set(finished) == {"map_0", "map_2", "map_3"}
    assert (tmp_path / "1").read_bytes() == b".."


def test_calls_that_are_given_up_end_at_once(executor: ClusterExecutor) -> None:
    with closing(executor.completed(time.sleep, {"short": (0,), "long": (3600,)})) as completed:
        assert next(completed) == ("short", None)
    assert run_all(abs, {"next": (-1,)}, executor, "numbers", False) == [1]


def test_workers_that_die_leave_their_calls_to_others(tmp_path: Path) -> None:
    calls = {str(n): (0.1,) for n in range(10)}
    with (
        cluster_of(tmp_path, workers=2) as cluster,
        ClusterExecutor(cluster.address, 3) as executor,
    ):
        done = []
        with closing(executor.completed(time.sleep, calls)) as completed:
            for name, result in completed:
                assert result is None
                done.append(name)
                if len(done) == 2:
                    cluster.kill_worker(0)
        assert sorted(done) == sorted(calls)


def test_a_call_that_takes_workers_along_is_reported(tmp_path: Path) -> None:
    calls = {"bad": (True,), **{str(n): (False,) for n in range(5)}}
    with cluster_of(tmp_path, workers=3) as cluster, ClusterExecutor(cluster.address) as executor:
        with closing(executor.completed(end_worker, calls)) as completed:
            results = dict(completed)
        assert sum(worker.poll() is not None for worker in cluster.workers) == 2
    death = results.pop("bad")
    assert isinstance(death, ProcessDeath)
    assert "the workers that ran it have died" in death.reason
    # A call that waits on a worker when it dies is held against that call too.
    done = [result for result in results.values() if result is None]
    assert sorted(results) == [str(n) for n in range(5)]
    assert len(done) >= 3
    assert all(isinstance(result, ProcessDeath) for result in results.values() if result)


def test_a_cluster_that_is_gone(tmp_path: Path) -> None:
    with (
        cluster_of(tmp_path, workers=1) as cluster,
        ClusterExecutor(cluster.address, timeout=3) as executor,
    ):
        cluster.kill_worker(0)
        with pytest.raises(ClusterError, match="has lost its last worker"):
            run_all(time.sleep, {"long": (3600,)}, executor, "calls", False)
        cluster.scheduler.kill()
        with pytest.raises(ClusterError, match="is gone"):
            run_all(time.sleep, {"long": (3600,)}, executor, "calls", False)


def test_nobody_answers(tmp_path: Path) -> None:
    with pytest.raises(ClusterError, match=r"no scheduler answers at 'tcp://127\.0\.0\.1:1'"):
        ClusterExecutor("tcp://127.0.0.1:1", timeout=0.2)
    with pytest.raises(ClusterError, match="no scheduler answers at 'nonsense://x'"):
        ClusterExecutor("nonsense://x", timeout=0.2)
    with pytest.raises(ConfigError, match="timeout"):
        ClusterExecutor("tcp://127.0.0.1:1", timeout=0)
    (tmp_path / "file").write_text("[1]")
    with pytest.raises(ClusterError, match="no file that dask scheduler"):
        ClusterExecutor(str(tmp_path / "file"))


def test_workers_that_cannot_do_the_work(tmp_path: Path) -> None:
    other, broken = tmp_path / "other", tmp_path / "broken"
    for folder in (other, broken):
        folder.mkdir()
    code = "import cbagan_ompl; cbagan_ompl.__version__ = '0.0.1'"
    (other / "sitecustomize.py").write_text(code)
    (broken / "cbagan_ompl.py").write_text("raise ModuleNotFoundError('no such package')")
    with cluster_of(tmp_path, workers=0) as cluster:
        with pytest.raises(ClusterError, match="has no worker; start some with: dask worker tcp:"):
            ClusterExecutor(str(cluster.file), timeout=0.2)
        cluster.start_worker(str(other))
        with pytest.raises(ClusterError, match=r"has cbagan-ompl 0\.0\.1, here are cbagan-ompl"):
            ClusterExecutor(str(cluster.file))
        cluster.kill_worker(0)
        cluster.workers[0].wait()
        cluster.start_worker(str(broken))
        with pytest.raises(ClusterError, match=r"cannot load cbagan-ompl.*no such package"):
            ClusterExecutor(str(cluster.file))


def test_dask_is_optional(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingDependencyError, match=r"needs distributed.*\[cluster\]"):
        ClusterExecutor("tcp://127.0.0.1:1")


def test_versions_are_those_that_decide_on_results() -> None:
    assert all(versions().values())
