"""Analysis of a clip (section 5 of Du et al. 2021). Each stage is one module.

`pipeline` knows the stages and their order. No stage imports another stage.
"""
