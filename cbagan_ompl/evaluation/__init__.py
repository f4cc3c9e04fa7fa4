"""Scores of predicted regions, next to predictors that know nothing."""
