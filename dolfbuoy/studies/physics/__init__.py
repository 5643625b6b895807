"""The worth of the physics: every effect left out, and the balance of energy."""
