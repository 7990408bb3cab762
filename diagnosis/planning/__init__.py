"""The run to record next: set-points that tell apart what a diagnosis could not."""
