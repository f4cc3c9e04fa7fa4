"""Scripts end with the exit status that they mean, and without complaints from the bindings."""

from __future__ import annotations

import subprocess
import sys

import pytest

PLAN = """
import numpy as np
free = np.ones((40, 40), bool)
free[20, :30] = False
grid = cbagan_ompl.GridMap(free)
result = cbagan_ompl.plan(grid, (5, 5), (5, 35), {planner!r}, "corridor", time=0.2)
assert result.sample_counts["learned"] > 0
print("done")
"""

# Everything is a module global and the attachment stays attached: the worst case for the bindings.
ATTACH = """
import numpy as np
from cbagan_ompl.planning import compat
free = np.ones((40, 40), bool)
free[20, :30] = False
grid = cbagan_ompl.GridMap(free)
heatmap = cbagan_ompl.Heatmap.corridor(grid, (5, 5), (5, 35))
space = compat.plane_space(*grid.bounds)
setup = og.SimpleSetup(space)
si = setup.getSpaceInformation()
setup.setStateValidityChecker(cbagan_ompl.GridValidityChecker(si, grid))
start, goal = compat.new_state(space), compat.new_state(space)
start[0], start[1], goal[0], goal[1] = 5.0, 5.0, 5.0, 35.0
setup.setStartAndGoalStates(start, goal)
planner = og.{planner}(si)
setup.setPlanner(planner)
attachment = cbagan_ompl.attach(setup, heatmap)
setup.solve(0.2)
assert attachment.sample_counts["learned"] > 0
print("done")
"""

OURS_FIRST = "import cbagan_ompl\nfrom cbagan_ompl.planning.compat import og\n"
OMPL_FIRST = "from ompl import base as ob, geometric as og\nimport cbagan_ompl\n"


@pytest.mark.parametrize("planner", ["RRT", "InformedRRTstar", "PRM"])
@pytest.mark.parametrize("imports", [OURS_FIRST, OMPL_FIRST], ids=["ours-first", "ompl-first"])
@pytest.mark.parametrize("job", [PLAN, ATTACH], ids=["plan", "attach"])
def test_exit_status_is_0(job: str, imports: str, planner: str) -> None:
    done = run(imports + job.format(planner=planner))
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("done\n")
    assert "leaked" not in done.stderr


@pytest.mark.parametrize("imports", [OURS_FIRST, OMPL_FIRST], ids=["ours-first", "ompl-first"])
def test_own_exit_status_is_kept(imports: str) -> None:
    done = run(imports + PLAN.format(planner="RRT") + "raise SystemExit(3)\n")
    assert done.returncode == 3, done.stderr
    assert done.stdout == "done\n"


def test_package_alone_loads_neither_ompl_nor_torch() -> None:
    done = run("import sys, cbagan_ompl\nassert not {'ompl', 'torch'} & set(sys.modules)\n")
    assert done.returncode == 0, done.stderr


def test_own_heatmap_needs_no_torch() -> None:
    block = "import sys\nsys.modules['torch'] = None\n"
    done = run(block + OURS_FIRST + PLAN.format(planner="RRT"))
    assert done.returncode == 0, done.stderr


def run(script: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=False
    )


@pytest.mark.parametrize(
    "imports",
    [
        "import cbagan_ompl\nfrom ompl import base as ob\n",
        "from ompl import base as ob\nimport cbagan_ompl\n",
        "import ompl\nimport cbagan_ompl\nimport ompl.geometric\nfrom ompl import base as ob\n",
        "import cbagan_ompl\nimport ompl\nimport ompl.util\nfrom ompl import base as ob\n",
    ],
)
@pytest.mark.parametrize(
    "work",
    [
        "cbagan_ompl.GridMap([[1, 1]])\nspace = ob.RealVectorStateSpace(2)\n",
        "space = ob.RealVectorStateSpace(2)\n",
    ],
)
def test_the_import_alone_protects_the_exit(imports: str, work: str) -> None:
    done = run(imports + work + "print('done')\n")
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr
