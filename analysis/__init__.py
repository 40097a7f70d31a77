"""Analysis of a clip: section 5 of Du et al. 2021, one module a stage.

clip -> statistics -> frame_hulls -> glue -> block_merging -> vertex_removal -> vertex_refinement
-> polytope -> sidecar. Only `pipeline` knows this order; no stage imports another.
"""
