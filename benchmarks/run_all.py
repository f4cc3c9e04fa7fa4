"""Make the result files that the documentation quotes, for both versions of OMPL.

    python benchmarks/run_all.py --maps MAPS --suites SUITES --dataset DATASET --output results \
        --other-python OTHER_VENV/bin/python
    cp results/*.json benchmarks/results/ && python scripts/results_tables.py

MAPS is a folder with `png/*.png` and `tasks.csv`, SUITES one with `bench-mr/*.map` and
`nav2/*.yaml`, DATASET the folder of the paper's (map, point, ROI) set. OTHER_VENV has the other
version of OMPL. Each file is a step; a step whose file is there is skipped, and a benchmark that
was interrupted goes on with the tasks that are missing, so the same command goes on.
Steps are independent: `--only` chooses some, `--list` prints their commands. All take under an hour
of two cores. Trainings, and what scores the networks on the paper's data, are not among them: see
benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from glob import glob
from pathlib import Path

from cbagan_ompl.common.files import write_json

ROOT = Path(__file__).resolve().parents[1]
STUDIES = ROOT / "benchmarks" / "studies"
SUITES = ROOT / "benchmarks" / "suites"
# The data, which are not part of the repository.
FOLDERS = ("maps", "suites", "dataset")
# What the tables do not need of a summary.
_UNUSED = ("families", "hosts")


@dataclass(frozen=True)
class Step:
    """One result file and the command that makes it.

    Attributes:
        name: of the file, without the version of OMPL.
        words: arguments of Python, with the places of ``--maps`` and others in braces.
        both: whether it is made for both versions of OMPL.
        is_benchmark: whether the result is the ``summary.json`` of a benchmark's folder.
    """

    name: str
    words: Sequence[str]
    both: bool = True
    is_benchmark: bool = False


def suite(name: str, file: str, *maps: str) -> Step:
    """Return the step of a suite."""
    words = ("-m", "cbagan_ompl.cli", "benchmark", *maps, f"@{SUITES / file}.args")
    return Step(name, words, is_benchmark=True)


def study(name: str, script: str, *words: str, both: bool = True) -> Step:
    """Return the step of a script that writes its own result."""
    return Step(name, (str(STUDIES / script), *words, "--json", "{json}"), both)


# What meets heat maps that are wrong on purpose, by the version of OMPL.
WRONG = {
    "2.0.1": "RRTConnect,RRT,RRTstar,InformedRRTstar,BKPIECE1",
    "1.7.0": "RRTConnect,RRT,LazyPRM,SST,KPIECE1,TRRT,BiEST",
}
REAL_MAPS = ("{maps}/png/*.png", "--tasks", "{maps}/tasks.csv")
STEPS = (
    suite("real_maps", "real_maps", *REAL_MAPS),
    suite("bundled", "bundled"),
    Step(
        "paper_suite",
        (
            str(STUDIES / "paper_suite.py"),
            *("{dataset}", "--tasks", "30", "--output", "{work}-tasks", "--run"),
            *(f"@{SUITES / 'paper.args'}", "--model", "paper-trained=cbagan"),
        ),
        is_benchmark=True,
    ),
    suite("street_maps", "street_maps", "{suites}/bench-mr/*.map"),
    suite("nav2_maps", "nav2_maps", "{suites}/nav2/*.yaml"),
    study("rrtconnect", "rrtconnect.py", *REAL_MAPS, "--runs", "3"),
    study("unseen_maps", "unseen_maps.py", *REAL_MAPS, "--runs", "3"),
    study(
        "wrong_heatmaps",
        "wrong_heatmaps.py",
        *("--planners", "{planners}", "--runs", "15", "--time", "3", "--most", "15000"),
    ),
    study("replanning_bundled", "replanning.py", both=False),
    study("replanning_real_maps", "replanning.py", *REAL_MAPS, "--tasks-per-map", "3", both=False),
    Step(
        "search_speed",
        (str(ROOT / "scripts" / "search_speed.py"), "--tasks", "1", "--json", "{json}"),
        both=False,
    ),
    Step("overhead", (str(ROOT / "scripts" / "overhead.py"), "--json", "{json}"), both=False),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in FOLDERS:
        parser.add_argument(f"--{name}", type=Path, default=Path(name.upper()), metavar="DIR")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--other-python", metavar="FILE", help="Python with the other OMPL")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="steps to be run")
    parser.add_argument("--jobs", metavar="N", help="tasks at a time (default: what suites say)")
    parser.add_argument("--list", action="store_true", help="print the commands, run nothing")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    places = {name: str(getattr(args, name)) for name in FOLDERS}
    jobs = [] if args.jobs is None else ["--jobs", args.jobs]
    pythons = {
        version_of(python): python for python in (sys.executable, args.other_python) if python
    }
    failed = []
    for version, python, step in steps_of(pythons, args.only):
        name = f"{step.name}_ompl_{version}" if step.both else step.name
        places["planners"] = WRONG.get(version, "RRT")
        if args.list:
            print(shlex.join(command(step, python, places, args.output, name, jobs)))
        elif not (args.output / f"{name}.json").exists():
            began = time.perf_counter()
            print(f"{name} ...", flush=True)
            status = run(step, python, places, args.output, name, jobs)
            print(f"{name}: status {status}, {time.perf_counter() - began:.0f} s", flush=True)
            failed += [name] if status else []
    if failed:
        raise SystemExit(f"failed, see the logs beside the results: {', '.join(failed)}")


def version_of(python: str) -> str:
    """Return the version of OMPL that a Python has."""
    code = "from cbagan_ompl.planning.compat import ompl_version; print(ompl_version())"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def steps_of(
    pythons: dict[str, str], only: Sequence[str] | None
) -> Iterator[tuple[str, str, Step]]:
    """Yield the version of OMPL, its Python and the step, in the order of the steps."""
    unknown = set(only or ()) - {step.name for step in STEPS}
    if unknown:
        raise SystemExit(f"no steps {', '.join(sorted(unknown))}; see --list")
    for step in STEPS:
        if only is None or step.name in only:
            for version, python in list(pythons.items())[: None if step.both else 1]:
                yield version, python, step


def command(
    step: Step, python: str, places: dict[str, str], output: Path, name: str, jobs: Sequence[str]
) -> list[str]:
    """Return the command of a step."""
    work = output / "work" / name
    known = {**places, "json": str(output / f"{name}.json"), "work": str(work)}
    words: list[str] = []
    for word in step.words:
        filled = word.format(**known)
        words += sorted(glob(filled)) or [filled]
    if step.is_benchmark:
        words += ["--output", str(work), *jobs]
        words += ["--resume"] if (work / "settings.json").exists() else []
    return [python, *words]


def run(
    step: Step, python: str, places: dict[str, str], output: Path, name: str, jobs: Sequence[str]
) -> int:
    """Run a step; return its exit status."""
    words = command(step, python, places, output, name, jobs)
    (output / "work").mkdir(exist_ok=True)
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with (output / "work" / f"{name}.log").open("a") as log:
        status = subprocess.run(words, stdout=log, stderr=log, env=environment).returncode
    if status == 0 and step.is_benchmark:
        text = (output / "work" / name / "summary.json").read_text()
        folders = {name: places[name] for name in FOLDERS}
        for folder, path in {**folders, "output": str(output), "root": str(ROOT)}.items():
            text = text.replace(path, folder.upper())
        summary = json.loads(text)
        for key in _UNUSED:
            del summary[key]
        write_json(output / f"{name}.json", summary)
    return status


if __name__ == "__main__":
    main()
