"""Install node.exe: the OpenFX node for all users; Windows asks for the rights."""

import contextlib
import ctypes
import sys

from palette4d.cli.main import main
from palette4d.hosts.bundle import system_destination

assert sys.platform == "win32"
_SHOWN, _LAST_ERROR = 1, 32  # of ShellExecuteW

if ctypes.windll.shell32.IsUserAnAdmin():
    # Not into a folder of this user's OFX_PLUGIN_PATH.
    everyone = ["--dest", str(system_destination())]
    status = main(["install-plugin", *(sys.argv[1:] or everyone)])
    with contextlib.suppress(EOFError):
        input("Enter closes this window. ")
    sys.exit(status)
asked = ctypes.windll.shell32.ShellExecuteW(None, "runas", sys.argv[0], None, None, _SHOWN)
if asked <= _LAST_ERROR:
    print(
        "Windows gave no rights, so nothing was installed. For yourself alone, in a Command Prompt "
        "here:\n"
        '  palette4d install-plugin --dest "%USERPROFILE%\\OFX"\n'
        '  setx OFX_PLUGIN_PATH "%USERPROFILE%\\OFX"'
    )
    with contextlib.suppress(EOFError):
        input("Enter closes this window. ")
    sys.exit(1)
