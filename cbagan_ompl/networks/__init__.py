"""The networks: architecture and the form that is exported. Imports nothing else of the package."""
