"""Exports: the edit as files that other programs read. Each file states its error.

    sidecar -> frame_edit -> shaper, lut3d (or cdl) -> formats, writers -> file -> bake_error

`bake` writes one file, `series` many frames, `config` the shots of a show.
"""
