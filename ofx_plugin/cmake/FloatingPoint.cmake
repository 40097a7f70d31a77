# One floating-point model for every target: the node, the bindings and the tests must agree to the
# last bit, so products are never fused into sums behind our back, and nothing is reassociated.
add_library(palette4d_floating_point INTERFACE)
target_compile_options(palette4d_floating_point INTERFACE -ffp-contract=off)
