"""The rig, the logs, their signals and faults."""
