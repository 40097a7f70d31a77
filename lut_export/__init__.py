"""Baking: the edit at one time as a lookup table that any OpenColorIO host reads.

`lattice` samples the edit, `formats` writes it through OpenColorIO, `bake` joins the two and states
the error of what was written. Sidecars are read through `palette4d._core` only.
"""
