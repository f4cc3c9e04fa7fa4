"""Damaged models, loaded without the trial in a child that unlisted ones have."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

# Loads what passes the checks, in a process of its own, since a crash would end this one.
_SCRIPT = """
import sys
from pathlib import Path
from cbagan_ompl import ModelError
from cbagan_ompl.inference.model_files import read_model
from cbagan_ompl.inference.model_loading import load_functions
from cbagan_ompl.inference.predictor import Predictor

for path in sorted(Path(sys.argv[1]).iterdir()):
    try:
        model = read_model(path)
    except ModelError as error:
        assert len(str(error)) < 1000, error
        print("refused")
        continue
    try:
        Predictor(load_functions(model), model.record).warm_up()
        print("loaded")
    except Exception:
        print("not loaded")
"""


def load_in_one_process(models: Iterable[bytes], suffix: str, folder: Path) -> Counter[str]:
    """Load models one after the other; count those refused, loaded and not loaded."""
    for number, data in enumerate(models):
        (folder / f"{number:03}{suffix}").write_bytes(data)
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(folder)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return Counter(done.stdout.split("\n"))
