"""The command `palette4d`. Each verb is one module."""

import os

# Only small matrices are multiplied: BLAS's threads would spin in vain, for 0.2 s of CPU a command.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
