"""Installing the node: the bundle, and the files that Kdenlive and Shotcut need to show it.

`bundle` installs the OpenFX bundle. `parameters` lists the node's parameters. `kdenlive` and
`shotcut` write them in the format of these programs. `editors` installs the files.
"""

#: The node's name in MLT, the engine of both programs.
SERVICE = "openfx.org.palette4d.Palette4D"

#: Every file contains this mark: a later version may replace a file with the mark.
MARK = "Written by palette4d"


def origin(version: str) -> str:
    """Return the line that names a file's writer and its version.

    It has no two hyphens in a row, because XML comments forbid them.
    """
    return f"{MARK} {version}, with install-plugin, which replaces this file by a later version."
