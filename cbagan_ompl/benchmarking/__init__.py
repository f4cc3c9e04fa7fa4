"""The benchmark runner: which tasks, in which processes, and what the results mean.

What drives OMPL is in :mod:`cbagan_ompl.planning.benchmark`; nothing here imports ompl itself. Data
flows one way: tasks -> one OMPL log for each -> database, statistics, report, plots.
"""
