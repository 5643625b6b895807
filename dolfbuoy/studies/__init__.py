"""Studies over many independent cases: the price of accuracy, stable elements, the worth of an effect."""
