"""Files by which editing programs show the node's parameters, where they do not by themselves.

`parameters` says what is shown, `kdenlive` and `shotcut` write it as those programs read it, and
`install` puts the files into their folders. `palette4d install-plugin` is the way in.
"""

#: The node's name in MLT, the engine of both programs.
SERVICE = "openfx.org.palette4d.Palette4D"

#: Every file says this: one that says so may be replaced by a later version.
MARK = "Written by palette4d"


def origin(version: str) -> str:
    """Return the line that names a file's writer and its version.

    It has no two hyphens, which XML has nowhere in a remark.
    """
    return f"{MARK} {version}, with install-plugin, which replaces this file by a later version."
