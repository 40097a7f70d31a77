"""Code for all parts: errors, arguments, text, atomic files."""
