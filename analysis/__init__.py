"""Analysis of a clip (section 5 of Du et al. 2021). Each stage is one module.

Only `pipeline` knows the order of the stages. No stage imports another one.
"""
