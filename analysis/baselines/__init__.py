"""The comparison methods of section 6.2 of the paper."""
