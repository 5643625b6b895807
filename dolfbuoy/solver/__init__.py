"""Unknowns, compiled forms and Newton's method: knows no buoy."""
