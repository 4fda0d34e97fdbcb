"""The command "run": configuration, simulation, its directory and the summary."""
