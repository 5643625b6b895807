"""Error bars: how far the numbers of a run may be from those of finer steps and elements."""
