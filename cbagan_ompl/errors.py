"""The exceptions of cbagan_ompl: one root, one class for each thing a user can get wrong."""

from __future__ import annotations


class CbaganOmplError(Exception):
    """Root of every exception that this package raises on purpose."""


class MapError(CbaganOmplError):
    """A map, a map file or a task file that cannot be used."""


class TaskError(CbaganOmplError):
    """A start or goal that cannot be planned for on this map."""


class HeatmapError(CbaganOmplError):
    """Values that are not a heat map of the grid that they came with."""


class ModelError(CbaganOmplError):
    """A file that is no exported model of this package, or does not match its record."""


class DatasetError(CbaganOmplError):
    """A training set that is missing, incomplete or malformed."""


class PlannerError(CbaganOmplError):
    """An unknown planner, or one that no hook of the installed OMPL reaches."""


class ConfigError(CbaganOmplError):
    """An option with a value that makes no sense, or an unknown option."""


class MissingDependencyError(CbaganOmplError):
    """An optional package that the called function needs is not installed."""
