"""The methods that section 6.2 of the paper compares with."""
