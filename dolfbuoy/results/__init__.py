"""Records of runs: noted, kept on disk, summed up and drawn."""
