"""What every room may use: checks, files, processes, tables. No maps, no networks, no ompl."""
