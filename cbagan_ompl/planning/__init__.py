"""The OMPL side: adapters, hooks and whole jobs. Nothing else in the package imports ompl."""
