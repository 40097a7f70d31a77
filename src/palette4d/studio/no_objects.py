"""Qt's streams make no Python objects.

PySide keeps such an object as a pickle in settings and in what is dragged, and reads it again with
`pickle.loads`, which runs what the pickle names.
"""

import pickle

from PySide6.QtCore import QByteArray, QDataStream, QIODevice


def refuse_objects() -> None:
    """Have PySide read None for each Python object in a stream, from now on."""
    stream = QByteArray()
    QDataStream(stream, QIODevice.OpenModeFlag.WriteOnly).writeQVariant(object())
    # It looks for the function once, at the first object, and keeps it.
    usual = pickle.loads
    pickle.loads = lambda *_: None
    try:
        QDataStream(stream, QIODevice.OpenModeFlag.ReadOnly).readQVariant()
    finally:
        pickle.loads = usual
