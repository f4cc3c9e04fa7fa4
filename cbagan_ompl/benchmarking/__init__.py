"""Benchmarks: the choice of tasks, the processes that run them, statistics, reports and plots.

Data flows one way: tasks -> one OMPL log for each -> database, statistics, report, plots. What
drives OMPL is in :mod:`cbagan_ompl.planning.ompl_benchmark`; nothing here imports ompl itself.
"""
