"""Static equilibrium: closed forms, Newton, continuation."""
