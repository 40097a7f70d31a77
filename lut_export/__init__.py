"""Exports: the edit as files that other programs read, each with its distance from the edit stated.

    sidecar -> frame_edit -> shaper, lattice (or cdl) -> writers, formats -> reading -> error

`bake` walks that road for one file, `series` for many frames, `config` for the shots of a show;
`cli`, `series_cli` and `config_cli` are their verbs. Sidecars are read through `palette4d._core`
only.
"""
