"""The neural networks: their configuration, their architecture and the form that is exported.

Imports nothing of the package outside itself but :mod:`cbagan_ompl.errors`.
"""
