"""Benchmarks: which tasks, in which processes, and what the results mean.

Data flows one way: tasks -> one OMPL log for each -> database, statistics, report, plots. What
drives OMPL is in :mod:`cbagan_ompl.planning.ompl_benchmark`; nothing here imports ompl itself.
"""
