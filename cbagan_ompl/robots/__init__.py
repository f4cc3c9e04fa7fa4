"""Robots: their shapes, and exact checks of shapes against the grid. Knows nothing of OMPL."""
