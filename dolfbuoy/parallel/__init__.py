"""Several ranks, many cases, and how they are interrupted."""
