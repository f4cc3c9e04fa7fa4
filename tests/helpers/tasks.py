"""The task that most tests plan on: see the fixture ``two_walls``."""

from __future__ import annotations

START, GOAL = (10.0, 10.0), (240.0, 240.0)
