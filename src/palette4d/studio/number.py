"""A field for a number, which is entered by Enter, the arrows, or by leaving it."""

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QDoubleSpinBox


class Number(QDoubleSpinBox):
    """A number; `valueChanged` tells of what the user enters alone.

    Parameters
    ----------
    name : str
        For screen readers.
    low, high : float
        The range.
    step : float
        What an arrow changes.
    decimals : int
    width : int
        Pixels.
    """

    def __init__(
        self, name: str, low: float, high: float, step: float, decimals: int, width: int
    ) -> None:
        """Begin with the number nearest to 0."""
        super().__init__()
        self.setAccessibleName(name)
        self.setDecimals(decimals)
        self.setRange(low, high)
        self.setSingleStep(step)
        self.setKeyboardTracking(False)
        self.setFixedWidth(width)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)  # not by the wheel

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Leave the wheel to what scrolls, unless a number is being entered."""
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()

    def show_number(self, value: float) -> None:
        """Show a number, unless another one is being typed."""
        if not self.hasFocus() or not self.lineEdit().isModified():
            with QSignalBlocker(self):
                self.setValue(value)
