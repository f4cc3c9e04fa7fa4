"""Settings of the documentation; it is built without any download.

sphinx-build -W --keep-going -b html docs build/docs
"""

from __future__ import annotations

import io
import os
import sys
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import cbagan_ompl  # noqa: E402

project = "cbagan-ompl"
author = "The cbagan-ompl developers"
copyright = author
release = version = cbagan_ompl.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
]
# Tables that scripts/results_tables.py writes are included by pages, and are no pages themselves.
exclude_patterns = ["results/generated"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_type_aliases = {"ArrayLike": "ArrayLike"}
napoleon_numpy_docstring = False
python_maximum_signature_line_length = 88
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

html_theme = "furo"
html_title = f"cbagan-ompl {release}"
html_show_copyright = False
html_theme_options = {"navigation_with_keys": True}


class CommandHelp(Directive):
    """The help of a command, as ``cbagan-ompl COMMAND --help`` prints it."""

    required_arguments = 0
    optional_arguments = 2

    def run(self) -> list[nodes.Node]:
        from cbagan_ompl.cli import main

        os.environ["COLUMNS"] = "96"
        with redirect_stdout(io.StringIO()) as printed, suppress(SystemExit):
            main([*self.arguments, "--help"])
        return [nodes.literal_block(printed.getvalue(), printed.getvalue(), language="text")]


def setup(app: Any) -> None:
    """Add the directive ``command-help``."""
    app.add_directive("command-help", CommandHelp)
