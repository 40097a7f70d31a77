"""The quality of a palette, and warnings about it."""
