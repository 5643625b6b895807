"""What accuracy costs, what is stable, what an effect is worth: many independent cases, and what came of them."""
