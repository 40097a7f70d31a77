"""OpenColorIO's own arithmetic, of a processor, on arrays of colours."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

F32 = NDArray[np.float32]


class ExactProcessor:
    """What an OpenColorIO processor computes without its approximations of logarithms and powers.

    Parameters
    ----------
    processor : PyOpenColorIO.Processor
        Of any transform.
    """

    def __init__(self, processor: Any) -> None:
        """Prepare it."""
        import PyOpenColorIO as ocio

        self._processor = processor
        self._cpu = processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)

    def transforms(self) -> list[Any]:
        """Return OpenColorIO's transforms that it consists of, in order."""
        import PyOpenColorIO as ocio

        optimized = self._processor.getOptimizedProcessor(ocio.OPTIMIZATION_LOSSLESS)
        return list(optimized.createGroupTransform())

    def __call__(self, colours: ArrayLike) -> F32:
        """Return the (…, 3) float32 colours that replace (…, 3) ones."""
        result = np.array(colours, dtype=np.float32, order="C")
        if result.size:
            self._cpu.applyRGB(result.reshape(1, -1, 3))
        return result
