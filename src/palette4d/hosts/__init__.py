"""Installing the node: the bundle, and the files that Kdenlive and Shotcut need to show it.

`bundle` installs the OpenFX bundle. `parameters` lists the node's parameters, `kdenlive` and
`shotcut` write them as those programs read them, `editors` puts the files into their folders.
"""

#: The node's name in MLT, the engine of both programs.
SERVICE = "openfx.org.palette4d.Palette4D"

#: Every file says this: one that says so may be replaced by a later version.
MARK = "Written by palette4d"


def origin(version: str) -> str:
    """Return the line that names a file's writer and its version.

    It holds no two hyphens in a row, which an XML comment may not have.
    """
    return f"{MARK} {version}, with install-plugin, which replaces this file by a later version."
