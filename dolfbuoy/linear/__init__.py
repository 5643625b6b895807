"""Small motions about an equilibrium."""
