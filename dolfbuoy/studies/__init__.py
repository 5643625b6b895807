"""What accuracy costs: studies that run many independent cases and say what came of it."""
