"""Scores of predicted regions, next to trivial baselines."""
