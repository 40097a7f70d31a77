"""Write the tables of gestures and keys of docs/studio.md from the window's own lists.

python docs/studio_keys.py            writes the tables into the page
python docs/studio_keys.py --check    exits 1 when the page is not up to date
"""

import sys
from itertools import groupby
from pathlib import Path

from palette4d.studio import texts
from palette4d.studio.menu_entries import ACTIONS, PALETTE, SOLID_ACTIONS, TIMELINE_ACTIONS, title

PAGE = Path(__file__).resolve().parent / "studio.md"
BEGIN = "<!-- begin: written by python docs/studio_keys.py -->"
END = "<!-- end: written by python docs/studio_keys.py -->"


def tables() -> str:
    """Return the tables of gestures and of keys in Markdown."""
    lines = ["| where | do this | and |", "|---|---|---|"]
    for where, gestures in groupby(texts.GESTURES, key=lambda row: row[0]):
        shown = where
        for _, gesture, what in gestures:
            lines.append(f"| {shown} | {gesture} | {what} |")
            shown = ""
    lines += ["", "| menu | action | keys |", "|---|---|---|"]
    listed = [(action, "") for action in ACTIONS]
    listed += [(action, f" {texts.IN_TIMELINE}") for action in TIMELINE_ACTIONS]
    listed += [(action, f" {texts.IN_SOLID}") for action in SOLID_ACTIONS]
    for menu in texts.MENUS:
        shown = title(menu)
        for action, where in listed:
            if action.menu == menu:
                keys = ", ".join(f"`{key}`" for key in action.keys)
                lines.append(f"| {shown} | {action.text} | {keys + where if keys else ''} |")
                shown = ""
        if menu == PALETTE:
            lines.append(f"|  | {texts.USE_A_VERSION} | `1` to `9` |")
    return "\n".join(lines)


def written(page: str) -> str:
    """Return the page with the tables of now."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n{tables()}\n\n{END}{after}"


def main() -> int:
    """Write the page, or check it."""
    page = PAGE.read_text(encoding="utf-8")
    new = written(page)
    if sys.argv[1:] == ["--check"]:
        return int(new != page)
    PAGE.write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
