"""How good a palette is, and what its user should know about it."""
