"""PyAV, imported with care.

Its wheels hold a GnuTLS that reads its settings from a folder in /tmp. There every user of the
computer could put a pipe, which would hold up the import for ever.
"""

import os

_SETTINGS = "GNUTLS_SYSTEM_PRIORITY_FILE"
_given = os.environ.get(_SETTINGS)
os.environ[_SETTINGS] = os.devnull if _given is None else _given
try:
    import av
    from av.codec.codec import Capabilities
    from av.error import FFmpegError
    from av.filter import Graph
    from av.sidedata.sidedata import Type
finally:
    if _given is None:  # for the programs that this process starts
        del os.environ[_SETTINGS]

__all__ = ["Capabilities", "FFmpegError", "Graph", "Type", "av"]
