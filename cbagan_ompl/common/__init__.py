"""Used by every other package: checks, files, processes, tables. No maps, networks or ompl."""
