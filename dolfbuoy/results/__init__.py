"""What is recorded of a run, kept on disk, summed up and drawn."""
