"""Add shortcuts.exe: Studio on the desktop, in the Start menu, and in *Open with* of sidecars."""

import contextlib
import sys
import winreg
from pathlib import Path

from PySide6.QtCore import QFile, QStandardPaths

assert sys.platform == "win32"
studio = Path(sys.argv[0]).with_name("Palette4D Studio.exe")
folders = QStandardPaths.StandardLocation
for folder in (folders.DesktopLocation, folders.ApplicationsLocation):
    shortcut = Path(QStandardPaths.writableLocation(folder), "Palette4D Studio.lnk")
    shortcut.unlink(missing_ok=True)
    if QFile.link(str(studio), str(shortcut)):
        print(f"made {shortcut}")
    else:
        print(f"could not make {shortcut}")
# To Windows a sidecar, .p4d.json, is a .json, which other programs open too.
program = rf"Software\Classes\Applications\{studio.name}"
with winreg.CreateKey(winreg.HKEY_CURRENT_USER, rf"{program}\shell\open\command") as key:
    winreg.SetValueEx(key, "", 0, winreg.REG_SZ, f'"{studio}" "%1"')
with winreg.CreateKey(winreg.HKEY_CURRENT_USER, rf"{program}\SupportedTypes") as key:
    winreg.SetValueEx(key, ".json", 0, winreg.REG_SZ, "")
print("A sidecar's menu in Explorer has: Open with > Palette4D Studio")
with contextlib.suppress(EOFError):
    input("Enter closes this window. ")
