"""What the physics is worth: every effect left out, and the balance of energy."""
