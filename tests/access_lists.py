"""Access lists of files, as Linux stores them in an extended attribute."""

import os
import struct
from pathlib import Path

NAME = "system.posix_acl_access"
#: The id of entries that name nobody.
NOBODY = 0xFFFFFFFF


def for_one(owner: int, rights: int, user: int = 12345) -> bytes:
    """Return a list: the owner's rights, another user's, none for the group and all others."""
    return of(
        *((1, owner, NOBODY), (2, rights, user), (4, 0, NOBODY)),
        *((16, rights, NOBODY), (32, 0, NOBODY)),  # at most the rights of the mask
    )


def of(*entries: tuple[int, int, int]) -> bytes:
    """Return the list of entries: whose rights, the rights, and a user's or group's number."""
    return struct.pack("<I", 2) + b"".join(struct.pack("<HHI", *entry) for entry in entries)


def entries(path: Path) -> list[tuple[int, int, int]]:
    """Return a file's list: whose rights, the rights, and a user's or group's number."""
    return list(struct.iter_unpack("<HHI", os.getxattr(path, NAME)[4:]))
