"""Importance of the physics: each effect left out, and the energy balance."""
