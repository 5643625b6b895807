"""Error bars: possible difference of the numbers of a run from those of finer steps and elements."""
