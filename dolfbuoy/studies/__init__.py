"""Studies over many independent cases: cost of accuracy, stability of elements, importance of effects."""
