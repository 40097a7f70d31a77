"""Analysis of a clip (section 5 of Du et al. 2021). Each stage is one module.

clip -> statistics -> frame_hulls -> glue -> block_merging -> vertex_removal -> vertex_refinement
-> polytope -> sidecar. Only `pipeline` knows this order. No stage imports another stage.
"""
