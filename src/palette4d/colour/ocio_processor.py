"""OpenColorIO processors, applied to arrays of colours."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

F32 = NDArray[np.float32]


class ExactProcessor:
    """An OpenColorIO processor without approximations of logarithms and powers."""

    def __init__(self, processor: Any) -> None:
        """Prepare it."""
        import PyOpenColorIO as ocio

        self._processor = processor
        self._cpu = processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)

    def transforms(self) -> list[Any]:
        """Return the processor's transforms, in order."""
        import PyOpenColorIO as ocio

        optimized = self._processor.getOptimizedProcessor(ocio.OPTIMIZATION_LOSSLESS)
        return list(optimized.createGroupTransform())

    def __call__(self, colours: ArrayLike) -> F32:
        """Return the (…, 3) float32 results for (…, 3) colours."""
        result = np.array(colours, dtype=np.float32, order="C")
        if result.size:
            self._cpu.applyRGB(result.reshape(1, -1, 3))
        return result
