"""OMPL's names of planners, and the other ways in which people write them.

Nothing here looks at the installed OMPL: the settings of a benchmark, which read names, load
without it.
"""

from __future__ import annotations

import re
from unicodedata import normalize

# The geometric planners of OMPL 1.7 and 2.0.
_NAMES = (
    *("ABITstar", "AITstar", "AORRTC", "BFMT", "BITstar", "BKPIECE1", "BLITstar", "BiEST"),
    *("BiTRRT", "EIRMstar", "EITstar", "EST", "FMT", "InformedRRTstar", "KPIECE1", "LBKPIECE1"),
    *("LBTRRT", "LazyLBTRRT", "LazyPRM", "LazyPRMstar", "LazyRRT", "PDST", "PRM", "PRMstar"),
    *("ProjEST", "RRT", "RRTConnect", "RRTXstatic", "RRTsharp", "RRTstar", "SBL", "SORRTstar"),
    *("SPARS", "SPARStwo", "SST", "STRIDE", "STRRTstar", "TRRT"),
)

# Names in the literature that are no spelling of OMPL's.
_ALIASES = {
    "bkpiece": "BKPIECE1",
    "fmtstar": "FMT",
    "kpiece": "KPIECE1",
    "lbkpiece": "LBKPIECE1",
    "rrtx": "RRTXstatic",
    "spars2": "SPARStwo",
}

# How MoveIt and scripts write the namespace.
_PREFIX = re.compile(r"(ompl\W+)?(geometric|og)\W+", re.IGNORECASE)


def planner_name(name: str) -> str:
    """Return OMPL's name of a planner, however its name is written.

    Upper and lower case, blanks, hyphens and underscores make no difference, "*" is read as "star"
    and "#" as "sharp".

    Args:
        name: such as ``"RRT*"``, ``"Informed RRT*"``, ``"rrt-connect"`` or ``"PRM star"``.

    Returns:
        The name of OMPL's class, or the argument itself where it is no way to write one.

    Example:
        >>> planner_name("Informed RRT*"), planner_name("rrt-connect"), planner_name("Magic")
        ('InformedRRTstar', 'RRTConnect', 'Magic')
    """
    return _BY_SPELLING.get(_simplify(name), name) if isinstance(name, str) else name


def _simplify(name: str) -> str:
    text = normalize("NFKC", _PREFIX.sub("", name.strip(), count=1)).lower()
    text = re.sub(r"[*\u2217\u22c6\u2605]", "star", text).replace("#", "sharp")
    return re.sub(r"[\s_-]", "", text)


_BY_SPELLING = {name.lower(): name for name in _NAMES} | _ALIASES
