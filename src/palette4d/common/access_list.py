"""Access lists of Linux: the rights that a file gives to users and groups by name (acl(5))."""

import os
import struct

#: The extended attribute that holds a file's list.
ACCESS_LIST = "system.posix_acl_access"

# Whose rights an entry has (linux/posix_acl_xattr.h): in this order, and by number within one kind.
_OWNER, _USER, _GROUP_OBJECT, _GROUP, _MASK, _OTHERS = 1, 2, 4, 8, 16, 32
_NOBODY = 0xFFFFFFFF


def with_names(old_list: bytes, old: os.stat_result, kept: tuple[bool, bool]) -> bytes:
    """Return a list that gives a file's former owner and group, by name, the rights that they had.

    Parameters
    ----------
    old_list : bytes
        The list of the file as it was; empty where it had none.
    old : stat_result
        Of that file.
    kept : (bool, bool)
        Whether the new file has its owner and its group. A new group gets what all users have.
    """
    entries = {
        (_OWNER, _NOBODY): old.st_mode >> 6 & 7,
        (_GROUP_OBJECT, _NOBODY): old.st_mode >> 3 & 7,
        (_OTHERS, _NOBODY): old.st_mode & 7,
    }
    for tag, rights, who in struct.iter_unpack("<HHI", old_list[4:]):
        entries[tag, who] = rights
    mask, others = entries.pop((_MASK, _NOBODY), 7), entries[_OTHERS, _NOBODY]
    for key in entries.keys() - {(_OWNER, _NOBODY), (_OTHERS, _NOBODY)}:
        entries[key] &= mask
    if not kept[0]:
        entries[_USER, old.st_uid] = entries[_OWNER, _NOBODY]
    if not kept[1]:
        group = entries[_GROUP_OBJECT, _NOBODY]
        entries[_GROUP, old.st_gid] = entries.get((_GROUP, old.st_gid), 0) | group
        entries[_GROUP_OBJECT, _NOBODY] = group & others
    limited = [value for (tag, _), value in entries.items() if tag not in (_OWNER, _OTHERS)]
    entries[_MASK, _NOBODY] = limited[0]
    for value in limited:
        entries[_MASK, _NOBODY] |= value
    packed = (struct.pack("<HHI", tag, entries[tag, who], who) for tag, who in sorted(entries))
    return struct.pack("<I", 2) + b"".join(packed)
