"""The layers of the package: which may import which, and what each may load."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "cbagan_ompl"

#: Each layer with the packages and modules below it, which are all that it may import.
BELOW = {
    "errors": set[str](),
    "networks": {"errors", "common"},
    "common": {"errors"},
    "map_generators": {"errors", "common"},
    "maps": {"errors", "common"},
    "robots": {"errors", "common", "maps"},
    "sampling": {"errors", "common", "maps", "robots"},
    # The limits of a model are those of the networks' configuration, which loads no torch.
    "inference": {"errors", "common", "maps", "robots", "sampling", "networks"},
    "planning": {"errors", "common", "maps", "robots", "sampling", "inference"},
    "benchmarking": {
        *("errors", "common", "maps", "robots", "sampling", "inference", "planning"),
    },
    "datasets": {
        *("errors", "common", "maps", "map_generators"),
        *("robots", "sampling", "inference", "planning"),
    },
}
BELOW["evaluation"] = BELOW["datasets"] | {"datasets"}
BELOW["training"] = BELOW["evaluation"] | {"evaluation", "networks"}
BELOW["plotting"] = BELOW["benchmarking"]
BELOW["cli"] = BELOW["training"] | {"training", "benchmarking", "plotting"}

MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


def layer_of(path: Path) -> str:
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


def imports(path: Path) -> Iterator[tuple[str, ...]]:
    """Dotted names that a module imports from the package, lazily or not, relative to it."""
    here = path.relative_to(PACKAGE).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] == PACKAGE.name:
                    yield tuple(alias.name.split(".")[1:])
        elif isinstance(node, ast.ImportFrom):
            module = tuple((node.module or "").split(".")) if node.module else ()
            if node.level == 0:
                if module[:1] == (PACKAGE.name,):
                    yield module[1:]
                continue
            base = (*here[: len(here) - node.level + 1], *module)
            yield from [(*base, alias.name) for alias in node.names]


def names(path: Path) -> set[str]:
    """Top-level packages that a module imports, lazily or not."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.add(node.module.split(".")[0])
    return found


def test_the_root_holds_layers_only() -> None:
    packages = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").is_file()}
    modules = {path.stem for path in PACKAGE.glob("*.py")} - {"__init__"}
    assert packages | modules == set(BELOW), (
        "a new layer needs an entry in BELOW, see docs/design.md"
    )
    assert modules == {"errors", "plotting"}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_run_down(path: Path) -> None:
    layer = layer_of(path)
    for target in imports(path):
        # The root holds the version and the public names.
        above = target[0] if target else PACKAGE.name
        allowed = BELOW[layer] | {layer, "__version__"}
        assert above in allowed, f"{path.relative_to(PACKAGE)} imports {'.'.join(target)}"


def test_no_two_modules_of_a_layer_import_each_other() -> None:
    """Only imports at the top of a module count: those inside functions close no circle."""
    graph: dict[str, set[str]] = {}
    known = {".".join(p.relative_to(PACKAGE).with_suffix("").parts): p for p in MODULES}
    for name, path in known.items():
        here = path.relative_to(PACKAGE).parts[:-1]
        graph[name] = set()
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ImportFrom) and node.level:
                base = here[: len(here) - node.level + 1]
                module = (*base, *(node.module.split(".") if node.module else ()))
                targets = {".".join(module), *(".".join((*module, a.name)) for a in node.names)}
                graph[name] |= {target for target in targets if target in known}
    done: set[str] = set()

    def visit(name: str, trail: tuple[str, ...]) -> None:
        assert name not in trail, " -> ".join((*trail[trail.index(name) :], name))
        if name not in done:
            for target in sorted(graph[name]):
                visit(target, (*trail, name))
            done.add(name)

    for name in graph:
        visit(name, ())


def test_who_may_import_ompl_torch_and_matplotlib() -> None:
    for path in MODULES:
        layer, packages = layer_of(path), names(path)
        assert "ompl" not in packages or layer == "planning", path
        if "torch" in packages:
            assert layer in {"networks", "training", "inference", "evaluation", "cli"}, path
        if "matplotlib" in packages:
            figures = {"figures", "plotting", "plots", "plot_styles", "sample_grid"}
            assert path.stem in figures, path


@pytest.mark.parametrize(
    ("module", "unloaded"),
    [
        ("cbagan_ompl", ("ompl", "torch", "matplotlib", "numba")),
        ("cbagan_ompl.cli", ("ompl", "torch", "matplotlib", "numba")),
        ("cbagan_ompl.training.config", ("torch",)),
        ("cbagan_ompl.planning.plan", ("torch", "matplotlib")),
    ],
)
def test_what_an_import_loads(module: str, unloaded: tuple[str, ...]) -> None:
    code = f"import sys, {module}; print([m for m in {unloaded} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_files_and_functions_stay_small() -> None:
    # The segment check is one loop on purpose; parsers follow their format line by line.
    long_functions = {"segment_is_free", "add_benchmark_parser"}
    for path in MODULES:
        text = path.read_text(encoding="utf-8")
        assert text.count("\n") <= 350, path
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef) and node.name not in long_functions:
                body = node.body[1:] if ast.get_docstring(node) else node.body
                lines = body[-1].end_lineno - body[0].lineno + 1 if body else 0  # type: ignore[operator]
                assert lines <= 60, f"{path.name}: {node.name} has {lines} lines"
