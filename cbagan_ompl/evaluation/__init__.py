"""Scores of predicted regions, next to those of trivial baselines."""
