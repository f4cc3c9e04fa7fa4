"""The choice of the pipeline for a model."""

from __future__ import annotations

from .graphs import Graphs
from .model_files import PASSAGE_METHODS, SPLIT_METHODS
from .passages import PassagesPipeline
from .pipelines import WavefrontPipeline, WholePipeline

#: Any of them.
Pipeline = WholePipeline | WavefrontPipeline | PassagesPipeline


def make_pipeline(graphs: Graphs) -> Pipeline:
    """Return the pipeline for the functions that a model has."""
    if all(map(graphs.has, SPLIT_METHODS)):
        return WavefrontPipeline(graphs)
    if all(map(graphs.has, PASSAGE_METHODS)):
        return PassagesPipeline(graphs)
    return WholePipeline(graphs)
