"""Access lists of Linux: the rights that a file gives to users and groups by name (acl(5))."""

import os
import struct

#: The extended attribute that holds a file's list.
ACCESS_LIST = "system.posix_acl_access"

# Whose rights an entry has (linux/posix_acl_xattr.h): in this order, and by number within one kind.
_OWNER, _USER, _GROUP_OBJECT, _GROUP, _MASK, _OTHERS = 1, 2, 4, 8, 16, 32
_NOBODY = 0xFFFFFFFF


def with_names(old_list: bytes, old: os.stat_result, new: os.stat_result) -> bytes:
    """Return a list that gives a file's former owner and group, by name, the rights that they had.

    Parameters
    ----------
    old_list : bytes
        The list of the file as it was; empty where it had none.
    old, new : stat_result
        Of that file, and of the one that replaces it. A new group gets no more than all users have.
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
    if new.st_uid != old.st_uid:
        entries[_USER, old.st_uid] = entries[_OWNER, _NOBODY]
    if new.st_gid != old.st_gid:
        group = entries[_GROUP_OBJECT, _NOBODY]
        entries[_GROUP, old.st_gid] = entries.get((_GROUP, old.st_gid), 0) | group
        own = entries.get((_GROUP, new.st_gid), 7)
        entries[_GROUP_OBJECT, _NOBODY] = group & others & own
    # Linux looks at no list whose mask is empty.
    entries[_MASK, _NOBODY] = others
    for (tag, _), rights in list(entries.items()):
        if tag not in (_OWNER, _OTHERS):
            entries[_MASK, _NOBODY] |= rights
    packed = (struct.pack("<HHI", tag, entries[tag, who], who) for tag, who in sorted(entries))
    return struct.pack("<I", 2) + b"".join(packed)
