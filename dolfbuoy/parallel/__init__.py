"""Parallel ranks, many cases, and interruption."""
