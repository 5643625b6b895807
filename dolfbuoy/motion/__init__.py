"""Motion: starts, time schemes, steps."""
