"""Every action of the window: its menu and its keys. `texts` has the words."""

import functools
from dataclasses import dataclass

from palette4d.studio import texts


@dataclass(frozen=True)
class Action:
    """One entry of a menu.

    Attributes
    ----------
    name : str
        Its name in `menu_actions`, or in the view.
    menu : str
        The menu: a key of `texts.MENUS`.
    keys : tuple of str
        Its keys, the first is shown.
    checks : bool
        It can be on or off.
    group : int
        Entries of one group stand together; a line divides the groups.
    view : str
        What has it: "window", "timeline" or "solid".
    """

    name: str
    menu: str
    keys: tuple[str, ...] = ()
    checks: bool = False
    group: int = 0

    view: str = "window"

    @property
    def text(self) -> str:
        """The entry's text."""
        return texts.ACTIONS[self.view][self.name]


FILE, EDIT, PALETTE, VIEW, PLAYBACK, HELP = texts.MENUS


def title(menu: str) -> str:
    """Return a menu's title as it is read, without the mark of its key."""
    return texts.MENUS[menu].replace("&", "")


ACTIONS = (
    Action("open", FILE, ("Ctrl+O",)),
    Action("find_clip", FILE),
    Action("save", FILE, ("Ctrl+S",), group=1),
    Action("save_as", FILE, ("Ctrl+Shift+S",), group=1),
    Action("revert", FILE, (), group=1),
    Action("analyze", FILE, ("Ctrl+N",), group=2),
    Action("analyze_again", FILE, (), group=2),
    Action("render", FILE, ("Ctrl+R",), group=3),
    Action("bake", FILE, ("Ctrl+B",), group=3),
    Action("export", FILE, ("Ctrl+E",), group=3),
    Action("config", FILE, (), group=3),
    Action("install", FILE, (), group=3),
    Action("next_shot", FILE, ("PgDown",), group=4),
    Action("previous_shot", FILE, ("PgUp",), group=4),
    Action("copy_grade", FILE, (), group=4),
    Action("quit", FILE, ("Ctrl+Q",), group=5),
    Action("undo", EDIT, ("Ctrl+Z",)),
    Action("redo", EDIT, ("Ctrl+Shift+Z", "Ctrl+Y")),
    Action("cancel", EDIT, ("Esc",), group=1),
    Action("reset_selected", EDIT, ("Delete", "Backspace"), group=1),
    Action("reset_all", EDIT, (), group=1),
    Action("preferences", EDIT, ("Ctrl+,",), group=2),
    Action("add_stop", PALETTE, ("S",)),
    Action("lock", PALETTE, ("Ctrl+L",)),
    Action("hold_pixel", PALETTE, ("H",)),
    Action("pick_pixel", PALETTE, ("P",)),
    Action("cross", PALETTE, (".",)),
    Action("act_from", PALETTE, ("Shift+I", "["), group=1),
    Action("act_until", PALETTE, ("Shift+O", "]"), group=1),
    Action("ramp_linear", PALETTE, (), group=2),
    Action("ramp_smooth", PALETTE, (), group=2),
    Action("ramp_hold", PALETTE, (), group=2),
    Action("save_version", PALETTE, ("V",), group=3),
    Action("compare_version", PALETTE, ("Shift+V",), group=3),
    Action("switch", PALETTE, ("B",), group=3),
    Action("show_after", VIEW, ("F1",), True),
    Action("show_before", VIEW, ("F2",), True),
    Action("show_wipe", VIEW, ("F3", "W"), True),
    Action("show_side", VIEW, ("F4",), True),
    Action("compare", VIEW, ("C",)),
    Action("fit", VIEW, ("F",), group=1),
    Action("one_to_one", VIEW, ("Ctrl+1",), group=1),
    Action("zoom_in", VIEW, ("Ctrl++", "Ctrl+="), group=1),
    Action("zoom_out", VIEW, ("Ctrl+-",), group=1),
    Action("outside", VIEW, ("X",), True, 2),
    Action("matte", VIEW, ("M",), True, 2),
    Action("brighter", VIEW, ("E",), group=3),
    Action("darker", VIEW, ("Shift+E",), group=3),
    Action("plain_look", VIEW, ("Ctrl+0",), group=3),
    Action("scopes", VIEW, ("Ctrl+Shift+W",), group=4),
    Action("reset_layout", VIEW, (), group=4),
    Action("full_screen", VIEW, ("F11",), True, 4),
    Action("play", PLAYBACK, ("Space",)),
    Action("play_backwards", PLAYBACK, ("J",)),
    Action("stop", PLAYBACK, ("K",)),
    Action("play_forwards", PLAYBACK, ("L",)),
    Action("next_frame", PLAYBACK, ("Right",), group=1),
    Action("previous_frame", PLAYBACK, ("Left",), group=1),
    Action("ten_on", PLAYBACK, ("Shift+Right",), group=1),
    Action("ten_back", PLAYBACK, ("Shift+Left",), group=1),
    Action("next_handle", PLAYBACK, ("Ctrl+Right",), group=1),
    Action("previous_handle", PLAYBACK, ("Ctrl+Left",), group=1),
    Action("go_to_selected", PLAYBACK, ("G",), group=1),
    Action("first_frame", PLAYBACK, ("Home",), group=1),
    Action("last_frame", PLAYBACK, ("End",), group=1),
    Action("mark_in", PLAYBACK, ("I",), group=2),
    Action("mark_out", PLAYBACK, ("O",), group=2),
    Action("clear_marks", PLAYBACK, ("Alt+X",), group=2),
    Action("loop", PLAYBACK, ("Ctrl+Shift+L",), True, 2),
    Action("first_steps", HELP),
    Action("manual", HELP, ("Ctrl+?",)),
    Action("about", HELP),
)

#: The keys that use a version; the menu has the versions that there are.
VERSION_ACTIONS = tuple(Action(f"version_{n}", PALETTE, (str(n),)) for n in range(1, 10))

_timeline = functools.partial(Action, view="timeline")
_solid = functools.partial(Action, view="solid")
#: Actions of the timeline and of the solid. Their keys work while the view has the keyboard, their
#: menu entries always.
TIMELINE_ACTIONS = (
    _timeline("select_all", PALETTE, ("Ctrl+A",)),
    _timeline("next_handle", PALETTE, ("Tab",)),
    _timeline("previous_handle", PALETTE, ("Shift+Tab",)),
    _timeline("row_above", PALETTE, ("Up",)),
    _timeline("row_below", PALETTE, ("Down",)),
    _timeline("stop_earlier", PALETTE, ("Alt+Left",)),
    _timeline("stop_later", PALETTE, ("Alt+Right",)),
    _timeline("zoom_in", VIEW, ("+",)),
    _timeline("zoom_out", VIEW, ("-",)),
    _timeline("show_all", VIEW, ("0",)),
    _timeline("rows_taller", VIEW, ("Alt+Up",)),
    _timeline("rows_lower", VIEW, ("Alt+Down",)),
)
#: Actions whose keys are watched by the views themselves, and cannot be changed.
FIXED = {
    "window": ("compare", "cancel"),
    "timeline": ("next_handle", "previous_handle"),
    "solid": ("next_colour",),
}
SOLID_ACTIONS = (
    _solid("next_colour", PALETTE, ("Tab",)),
    _solid("reset_view", VIEW, ("0",)),
)
