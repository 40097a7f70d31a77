# Warnings for our own code; PALETTE4D_WERROR (tests, CI) makes them errors.
option(PALETTE4D_WERROR "Treat warnings as errors" OFF)
add_library(palette4d_warnings INTERFACE)
target_compile_options(palette4d_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  $<$<BOOL:${PALETTE4D_WERROR}>:-Werror>)
