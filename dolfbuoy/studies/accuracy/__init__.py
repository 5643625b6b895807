"""What accuracy costs: errors of elements and schemes, and the time of a run and of a step."""
