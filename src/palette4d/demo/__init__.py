"""The built-in sample clip."""
