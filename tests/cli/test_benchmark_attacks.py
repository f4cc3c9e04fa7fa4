"""The command ``benchmark`` among signals, full disks, odd names and damaged folders."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.benchmarks import TASKS, Finished
from helpers.fuzzing import mutations, read_all

from cbagan_ompl import CbaganOmplError, ConfigError
from cbagan_ompl.benchmarking.benchmark import Benchmark, write_results
from cbagan_ompl.benchmarking.inputs import check_same, record_inputs
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.tasks import select_tasks
from cbagan_ompl.benchmarking.worker import Job, check_log
from cbagan_ompl.cli import main

COMMAND = [sys.executable, "-m", "cbagan_ompl.cli", "benchmark"]
QUICK = ["--planners", "RRT", "--samplers", "uniform", "--runs", "1", "--range", "10"]


def words_for(map_folder: Path, folder: Path, *more: str) -> list[str]:
    """Two tasks of many rounds: whatever ends the command comes while they run."""
    words = [str(map_folder / "walls.png"), "--tasks", str(map_folder / "tasks.csv")]
    words += ["--planners", "RRTstar", "--samplers", "uniform,corridor", "--time", "0.05"]
    return [*words, "--runs", "400", "--jobs", "2", "--output", str(folder), *more]


def files_in(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


@pytest.fixture
def temporary(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty folder for temporary files, with a name short enough for sockets."""
    with tempfile.TemporaryDirectory() as folder:
        monkeypatch.setenv("TMPDIR", folder)
        yield Path(folder)


def children_of(process: int) -> list[int]:
    """All processes below one."""
    listed = subprocess.run(
        ["ps", "-e", "-o", "pid=,ppid="], capture_output=True, text=True, check=True
    )
    parents = {int(a): int(b) for a, b in map(str.split, listed.stdout.splitlines())}
    found: list[int] = []
    for pid in parents:
        above = parents.get(pid)
        while above and above != process:
            above = parents.get(above)
        if above == process:
            found.append(pid)
    return found


def await_children(process: subprocess.Popen[str], count: int) -> list[int]:
    end = time.monotonic() + 60
    while time.monotonic() < end and process.poll() is None:
        found = children_of(process.pid)
        if len(found) >= count:
            return found
        time.sleep(0.05)
    raise AssertionError("the processes of the tasks have not come")


# --- signals ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(
    ("numbers", "status", "said"),
    [
        ([signal.SIGTERM], 143, "terminated"),
        ([signal.SIGINT, signal.SIGINT], 130, "interrupted"),
        ([signal.SIGTERM, signal.SIGTERM, signal.SIGINT], 143, "terminated"),
    ],
)
def test_signals_end_it_with_its_children(
    map_folder: Path, tmp_path: Path, temporary: Path, numbers: list[int], status: int, said: str
) -> None:
    folder = tmp_path / "out"
    process = subprocess.Popen(
        [*COMMAND, *words_for(map_folder, folder)],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    # The tracker of resources, the server of processes, and those of two tasks.
    children = await_children(process, 4)
    start = time.monotonic()
    for number in numbers:
        process.send_signal(number)
        time.sleep(0.02)
    out, error = process.communicate(timeout=60)
    assert time.monotonic() - start < 2.5
    assert process.returncode == status
    assert out == ""
    # What the progress bar wrote ends with a carriage return.
    lines = [line for line in error.split("\n") if "round" not in line and line.strip()]
    assert lines == [f"{said}; go on with the same command and --resume"]
    end = time.monotonic() + 5
    while any(os.path.exists(f"/proc/{child}") for child in children) and time.monotonic() < end:
        time.sleep(0.05)
    assert not any(os.path.exists(f"/proc/{child}") for child in children)
    assert files_in(temporary) == set()
    assert files_in(folder) == {"settings.json", "logs"}


@pytest.mark.slow
def test_background_jobs_of_a_shell_run_to_their_end(map_folder: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    words = words_for(map_folder, folder, "--runs", "12", "--jobs", "1")
    # A shell without job control lets background jobs ignore SIGINT.
    script = '"$@" 2>"$OUT.err" & child=$!; echo $child; wait $child; echo $?'
    process = subprocess.Popen(
        ["sh", "-c", script, "sh", *COMMAND, *words],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "OUT": str(tmp_path / "out")},
    )
    assert process.stdout is not None
    child = int(process.stdout.readline())
    while not (folder / "logs").is_dir() and process.poll() is None:
        time.sleep(0.02)
    for _ in range(3):
        time.sleep(0.3)
        os.kill(child, signal.SIGINT)
    printed, _ = process.communicate(timeout=300)
    assert printed.endswith("\n0\n"), (tmp_path / "out.err").read_text()
    summary = json.loads((folder / "summary.json").read_text())
    assert (summary["tasks"], summary["failures"]) == (2, {})


# --- full disks -------------------------------------------------------------------------------

# A limit on the size of files stands for a full disk: writing fails, with another error.
_LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
sys.argv[1:] = sys.argv[2:]
from cbagan_ompl.cli.__main__ import run
run()
"""


def run_with_small_files(limit: int, words: list[str]) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, "-B", "-c", _LIMITED, str(limit), *words],
        capture_output=True,
        text=True,
    )
    return done.returncode, "".join(
        line for line in done.stderr.splitlines(True) if "round/s" not in line
    )


@pytest.mark.slow
@pytest.mark.parametrize("limit", [64, 1000, 12_000])
def test_a_full_disk_while_tasks_run(
    map_folder: Path, tmp_path: Path, temporary: Path, limit: int
) -> None:
    folder = tmp_path / "out"
    words = [str(map_folder / "walls.png"), "--tasks", str(map_folder / "tasks.csv"), *QUICK]
    words = ["benchmark", *words, "--jobs", "1", "--output", str(folder)]
    status, said = run_with_small_files(limit, words)
    assert status == 2, said
    assert "Traceback" not in said
    assert said.count("cbagan-ompl benchmark: ") == 1
    assert len(said) < 1000
    assert any(part in said for part in ("File too large", "its log", "disk I/O error"))
    assert files_in(temporary) == set()
    assert all(name.endswith(("settings.json", "logs", ".log")) for name in files_in(folder))
    if "settings.json" in files_in(folder):
        words.append("--resume")
    assert main(words) == 0


@pytest.mark.slow
def test_a_full_disk_while_results_are_written(
    finished: Finished, tmp_path: Path, temporary: Path
) -> None:
    folder = shutil.copytree(finished.folder, tmp_path / "out")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    words = [*finished.arguments[:-1], str(folder), "--resume"]
    status, said = run_with_small_files(30_000, words)
    assert status == 2, said
    assert said == f"cbagan-ompl benchmark: cannot write {folder}/benchmark.db: disk I/O error\n"
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert after == before
    assert files_in(temporary) == set()
    assert main(words) == 0


@pytest.mark.parametrize("name", ["summary.json", "summary.md", "success.png", "nodes.pdf"])
def test_results_that_cannot_be_written_are_named(
    finished: Finished, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = shutil.copytree(finished.folder, tmp_path / "out")
    (folder / name).unlink()
    (folder / name).mkdir()
    words = [*finished.arguments[:-1], str(folder), "--resume"]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert name in said
    assert "cannot write" in said
    assert not list(folder.rglob("*.tmp"))
    (folder / name).rmdir()
    assert main(words) == 0


# --- going on ---------------------------------------------------------------------------------


@pytest.fixture
def going_on(finished: Finished, tmp_path: Path) -> tuple[Path, list[str]]:
    folder = shutil.copytree(finished.folder, tmp_path / "out")
    return folder, [*finished.arguments[:-1], str(folder), "--resume"]


def edit_settings(folder: Path, edit: Callable[[dict], None]) -> None:  # type: ignore[type-arg]
    path = folder / "settings.json"
    values = json.loads(path.read_text())
    edit(values)
    path.write_text(json.dumps(values))


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda v: v.update(ompl_version="1.6.0"), "ompl_version is '1.6.0' there and"),
        (lambda v: v.update(package_version="0"), "package_version is '0' there and"),
        (lambda v: v["maps"]["walls"].update(hash="0"), "maps walls hash is '0' there"),
        (lambda v: v["maps"]["walls"].update(resolution=2), "maps walls resolution is 2 there"),
        (lambda v: v["tasks"]["walls_1"].update(goal=[1, 2]), "tasks walls_1 goal is [1, 2] there"),
        (lambda v: v["tasks"].pop("walls_1"), "tasks walls_1 is 'nothing' there"),
        (lambda v: v["tasks"].update(x_0={}), "tasks x_0 is {} there and 'nothing' now"),
        (lambda v: v.update(runs=4), "runs is 4 there and 3 now"),
        (lambda v: v.pop("tasks"), "tasks is 'nothing' there"),
        (lambda v: v.clear(), " more. Give the same ones"),
    ],
)
def test_what_differs_from_the_benchmark_of_the_folder_is_said(
    going_on: tuple[Path, list[str]],
    edit: Callable[[dict], None],  # type: ignore[type-arg]
    message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder, words = going_on
    edit_settings(folder, edit)
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "other options, versions, maps or tasks" in said
    assert message in said
    assert len(said) < 1000


def test_maps_and_tasks_of_another_content_are_refused(
    map_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    maps = shutil.copytree(map_folder, tmp_path / "maps")
    words = ["benchmark", str(maps / "walls.png"), "--tasks", str(maps / "tasks.csv"), *QUICK]
    words += ["--output", str(tmp_path / "out")]
    assert main(words) == 0
    pixels = cv2.imread(str(maps / "walls.png"), cv2.IMREAD_GRAYSCALE)
    pixels[50, 50] = 0
    cv2.imwrite(str(maps / "walls.png"), pixels)
    assert main([*words, "--resume"]) == 2
    assert "maps walls hash" in capsys.readouterr().err
    shutil.copy(map_folder / "walls.png", maps)
    (maps / "tasks.csv").write_text(TASKS.replace("10,10,90,90", "11,10,90,90"))
    assert main([*words, "--resume"]) == 2
    assert "tasks walls_0 start is [10.0, 10.0] there" in capsys.readouterr().err
    (maps / "tasks.csv").write_text(TASKS)
    assert main([*words, "--resume"]) == 0


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda path: path.write_text(""), "settings.json is damaged"),
        (lambda path: path.write_text("[]"), "settings.json is damaged"),
        (lambda path: path.write_text("[" * 100_000), "settings.json is damaged"),
        (lambda path: path.write_text("9" * 5000), "settings.json is damaged"),
        (lambda path: path.write_bytes(b"\xff\xfe"), "settings.json is damaged"),
        (lambda path: (path.unlink(), path.mkdir()), "it is a folder"),
        (lambda path: (path.unlink(), os.mkfifo(path)), "a device or a pipe"),
        (lambda path: (path.unlink(), path.symlink_to("/dev/zero")), "a device or a pipe"),
        (lambda path: path.unlink(), "settings.json is missing"),
    ],
)
def test_damaged_settings(
    going_on: tuple[Path, list[str]],
    damage: Callable[[Path], object],
    message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder, words = going_on
    damage(folder / "settings.json")
    assert main(words) == 2
    said = capsys.readouterr().err
    assert message in said
    assert "choose another folder" in said
    assert len(said) < 1000


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:3000])


def edit(old: str, new: str) -> Callable[[Path], None]:
    def change(path: Path) -> None:
        path.write_text(path.read_text().replace(old, new))

    return change


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (cut, "cut off"),
        (lambda path: path.write_text(""), "no benchmark log"),
        (lambda path: path.write_bytes(b"\0\xff" * 99), "no text file"),
        (lambda path: (path.unlink(), path.mkdir()), "it is a folder"),
        (lambda path: (path.unlink(), os.mkfifo(path)), "a device or a pipe"),
        (lambda path: shutil.copy(path.parent / "walls_0.log", path), "something else: name"),
        (edit("goal_x REAL = 10", "goal_x REAL = 9"), "goal_x REAL is '9' there"),
        (edit("collision checks", "other checks"), "collision checks INTEGER is None"),
        (edit("3 runs", "2 runs"), "no benchmark log"),
    ],
)
def test_damaged_logs_are_named_with_the_cure(
    going_on: tuple[Path, list[str]],
    damage: Callable[[Path], object],
    message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder, words = going_on
    log = folder / "logs" / "walls_1.log"
    damage(log)
    assert main(words) == 2
    said = capsys.readouterr().err
    assert message in said
    assert f"Delete {log}, then go on with --resume" in said
    assert len(said) < 1000


def test_sql_in_a_log_is_refused(
    going_on: tuple[Path, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, words = going_on
    log = folder / "logs" / "walls_0.log"
    log.write_text(log.read_text().replace("memory REAL", "m REAL); ATTACH 'x.db' AS y; --"))
    before = (folder / "benchmark.db").read_bytes()
    assert main(words) == 2
    assert "no name of a property with its type" in capsys.readouterr().err
    assert (folder / "benchmark.db").read_bytes() == before


@pytest.mark.slow
def test_damaged_folders_are_read_or_refused(finished: Finished, tmp_path: Path) -> None:
    """What is made of logs and settings that pass the checks must not fail any more."""
    tasks = select_tasks([finished.arguments[1]], finished.arguments[7]).tasks
    settings = Settings(
        ("RRT", "RRTstar"), ("uniform", "corridor"), 3, 0.1, 10.0, {"RRTstar": {"goal_bias": 0.1}}
    )
    folder = shutil.copytree(finished.folder, tmp_path / "out")
    log, saved = folder / "logs" / "walls_1.log", folder / "settings.json"
    drawn = 0

    def read_log_of_folder(data: bytes) -> None:
        nonlocal drawn
        log.write_bytes(data)
        benchmark = Benchmark(tasks, settings, folder, resume=True)
        logs = benchmark.finished_logs({})
        if drawn < 4:  # the plots take a second
            drawn += 1
            write_results(logs, settings, {}, folder, "command")

    numbers = iter(range(10**6))

    def change_digits() -> Iterator[bytes]:
        text = log.read_bytes()
        rng = np.random.default_rng(3)
        spots = [i for i, c in enumerate(text) if chr(c).isdigit() and i > len(text) // 3]
        for _ in range(60):
            changed = bytearray(text)
            for spot in rng.choice(spots, size=4):
                changed[spot : spot + 1] = [b"0", b"9e99", b"-1", b"7"][next(numbers) % 4]
            yield bytes(changed)

    whole = log.read_bytes()
    counts = read_all(read_log_of_folder, change_digits())
    counts += read_all(read_log_of_folder, mutations([whole], 40, 5))
    assert min(counts.values()) > 2
    log.write_bytes(whole)

    record = record_inputs(tasks, settings)

    def read_settings(data: bytes) -> None:
        saved.write_bytes(data)
        check_same(record, saved)

    counts = read_all(read_settings, mutations([saved.read_bytes()], 600, 6))
    assert counts["refused"] > 400


# --- names ------------------------------------------------------------------------------------

NAMES = ["a$b", "$x^$", "new\nline", "c|d", "ä地图", "-x", "e;f", "g'h\"i", "{y}%s", "x" * 200]


@pytest.mark.slow
def test_odd_names_of_maps_and_families(
    map_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    maps = []
    for name in NAMES:
        maps.append(str(tmp_path / f"{name}.png"))
        shutil.copy(map_folder / "walls.png", maps[-1])
    maps.append(os.fsdecode(os.fsencode(tmp_path) + b"/b\xff\xfe.png"))
    shutil.copy(map_folder / "walls.png", maps[-1])
    words = ["benchmark", *maps, "--tasks-per-map", "1", "--planners", "RRT", "--runs", "1"]
    words += ["--samplers", "uniform,corridor", "--time", "0.3", "--range", "20"]
    assert main([*words, "--output", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr()
    assert "Warning" not in printed.err
    assert "Traceback" not in printed.err
    families = json.loads((tmp_path / "out" / "summary.json").read_text())["families"]
    assert len(families) == len(maps)
    assert "new\\nline" in families
    assert (tmp_path / "out" / "ratio_first_solution.pdf").is_file()
    assert len(list((tmp_path / "out" / "logs").glob("*.log"))) == len(maps)


def test_names_that_agree_in_files_are_refused(map_folder: Path, tmp_path: Path) -> None:
    for name in ("a b", "a_b"):
        shutil.copy(map_folder / "walls.png", tmp_path / f"{name}.png")
    with pytest.raises(ConfigError, match="two a_b_0"):
        select_tasks([str(tmp_path / f"{name}.png") for name in ("a b", "a_b")])


@pytest.mark.parametrize(
    "words",
    [
        ["m\0.png"],
        ["x" * 300 + ".png"],
        ["x" * 251 + ".map"],
        ["bundled:maze", "--tasks", "t\0.csv"],
        ["bundled:maze", "--tasks", "t" * 300 + ".scen"],
        ["bundled:maze", "--output", "o\0"],
        ["bundled:maze", "--output", "o" * 300],
        ["bundled:maze", "--output", "/dev/null/x"],
        ["bundled:maze", "--output", "/dev/null"],
        ["bundled:maze", "--heatmap-dir", "x=" + "d" * 300],
        ["bundled:maze", "--heatmap-dir", "x=d\0"],
        ["bundled:maze", "--heatmap-dir", "x\ny=."],
        ["bundled:maze", "--model", "m" * 300],
        ["bundled:maze", "--model", "peer=m\0"],
        ["bundled:maze", "--model", "a=" + "m" * 300],
        ["bundled:maze", "--set", "RRT.range=" + "9" * 5000],
        ["bundled:maze", "--set", "RRT.range=!!timestamp x"],
        ["bundled:maze", "--set", "RRT.range=" + "[" * 10_000],
        ["bundled:maze", "--set", "RRT." + "x" * 5000 + "=1"],
        ["bundled:maze", "--set", "\udcff.range=1"],
        ["bundled:maze", "--runs", "9" * 5000],
        ["bundled:maze", "--runs", "9" * 20],
        ["bundled:maze", "--time", "1e400"],
        ["bundled:maze", "--time", "nan"],
        ["bundled:maze", "--time", "1e300"],
        ["bundled:maze", "--range", "1e400"],
        ["bundled:maze", "--radius", "1e400"],
        ["bundled:maze", "--radius", "1e300"],
        ["bundled:maze", "--radius", "nan"],
        ["bundled:maze", "--within", "9" * 30],
        ["bundled:maze", "--jobs", "9" * 30],
        ["bundled:maze", "--seed", "9" * 4000],
        ["bundled:maze", "--tasks-per-map", "9" * 30],
        ["bundled:maze", "--planners", "x" * 10_000],
        ["bundled:maze", "--planners", ",".join(map(str, range(9999)))],
        ["bundled:maze", "--samplers", "\0"],
        ["@missing"],
        ["@"],
        ["@."],
        ["@/dev/zero"],
        ["@m\0"],
        ["@" + "x" * 300],
        ["@recursive"],
        ["@twice"],
        ["@binary"],
        ["@huge"],
        ["@pipe"],
    ],
)  # fmt: skip
def test_odd_words_are_status_2(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Benchmark, "run", lambda *_: pytest.fail("it runs"))
    Path("x" * 251 + ".map").write_text("type octile\nheight 1\nwidth 1\nmap\n@\n")
    Path("recursive").write_text("@recursive\n")
    Path("twice").write_text("@twice\n@twice\n" * 1000)
    Path("binary").write_bytes(bytes(range(256)))
    Path("huge").write_text("\n" * 2**21)
    os.mkfifo("pipe")
    common = ["benchmark", "--planners", "RRT", "--samplers", "uniform", "--output", "out"]
    try:
        status = main([*common, *words])
    except SystemExit as error:  # from the parser
        status = int(str(error.code))
    said = capsys.readouterr().err
    assert status == 2, said
    assert 0 < len(said) < 1000
    assert "Traceback" not in said
    assert not Path("out").exists()


def test_a_task_that_needs_no_path(map_folder: Path, tmp_path: Path) -> None:
    (tmp_path / "tasks.csv").write_text("map,start_x,start_y,goal_x,goal_y\nwalls,10,10,10.5,10\n")
    words = ["benchmark", str(map_folder / "walls.png"), "--tasks", str(tmp_path / "tasks.csv")]
    words += [*QUICK, "--samplers", "uniform,corridor", "--planners", "RRT,RRTstar"]
    words += ["--radius", "1"]  # inflated maps go to the processes as well
    assert main([*words, "--output", str(tmp_path / "out")]) == 0


def test_logs_are_those_of_their_task(finished: Finished) -> None:
    tasks = select_tasks([finished.arguments[1]], finished.arguments[7]).tasks
    settings = Settings(
        ("RRT", "RRTstar"), ("uniform", "corridor"), 3, 0.1, 10.0, {"RRTstar": {"goal_bias": 0.1}}
    )
    jobs = [Job(task, settings, finished.folder / "logs" / f"{task.name}.log") for task in tasks]
    for job, log in zip(jobs, finished.logs, strict=True):
        check_log(log, job)
    with pytest.raises(CbaganOmplError, match="something else"):
        check_log(finished.logs[1], jobs[0])


def test_a_temporary_folder_whose_name_is_too_long_for_sockets(
    map_folder: Path, tmp_path: Path
) -> None:
    folder = tmp_path / ("long" * 30)
    folder.mkdir()
    done = subprocess.run(
        [*COMMAND, *words_for(map_folder, tmp_path / "out")],
        env={**os.environ, "TMPDIR": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "set TMPDIR to a folder with a shorter name" in done.stderr
