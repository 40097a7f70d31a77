"""Colour spaces, conversions and colour difference, through OpenColorIO."""
