"""Every action of the window: its menu, its text and its keys. docs/studio.md lists them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Action:
    """One entry of a menu.

    Attributes
    ----------
    name : str
        The window's method that does it.
    menu : str
        The menu's title.
    text : str
        The entry's text.
    keys : tuple of str
        Its keys, the first is shown.
    checks : bool
        It can be on or off.
    group : int
        Entries of one group stand together; a line divides the groups.
    """

    name: str
    menu: str
    text: str
    keys: tuple[str, ...] = ()
    checks: bool = False
    group: int = 0


FILE, EDIT, PALETTE, VIEW, PLAYBACK, HELP = (
    "File",
    "Edit",
    "Palette",
    "View",
    "Playback",
    "Help",
)

ACTIONS = (
    Action("open", FILE, "Open…", ("Ctrl+O",)),
    Action("find_clip", FILE, "Find the clip…"),
    Action("save", FILE, "Save", ("Ctrl+S",), group=1),
    Action("save_as", FILE, "Save as…", ("Ctrl+Shift+S",), group=1),
    Action("revert", FILE, "Load the file again", (), group=1),
    Action("analyze", FILE, "Analyse…", ("Ctrl+N",), group=2),
    Action("analyze_again", FILE, "Analyse again, keep edits…", (), group=2),
    Action("render", FILE, "Render…", ("Ctrl+R",), group=3),
    Action("bake", FILE, "Bake a LUT…", ("Ctrl+B",), group=3),
    Action("export", FILE, "Export LUTs over time…", ("Ctrl+E",), group=3),
    Action("config", FILE, "OpenColorIO config…", (), group=3),
    Action("install", FILE, "Install the node…", (), group=3),
    Action("next_shot", FILE, "Next shot", ("PgDown",), group=4),
    Action("previous_shot", FILE, "Previous shot", ("PgUp",), group=4),
    Action("copy_grade", FILE, "Copy this grade to a shot…", (), group=4),
    Action("quit", FILE, "Quit", ("Ctrl+Q",), group=5),
    Action("undo", EDIT, "Undo", ("Ctrl+Z",)),
    Action("redo", EDIT, "Redo", ("Ctrl+Shift+Z", "Ctrl+Y")),
    Action("cancel", EDIT, "Cancel, select nothing", ("Esc",), group=1),
    Action("reset_selected", EDIT, "Reset the selected handles", ("Delete", "Backspace"), group=1),
    Action("reset_all", EDIT, "Reset everything", (), group=1),
    Action("add_stop", PALETTE, "Add a stop at the playhead", ("S",)),
    Action("lock", PALETTE, "Lock or unlock the selected", ("Ctrl+L",)),
    Action("hold_pixel", PALETTE, "Hold the colour under the pointer", ("H",)),
    Action("pick_pixel", PALETTE, "Pick the colour under the pointer", ("P",)),
    Action("ramp_linear", PALETTE, "Ramp: linear", (), group=1),
    Action("ramp_smooth", PALETTE, "Ramp: smooth", (), group=1),
    Action("ramp_hold", PALETTE, "Ramp: hold", (), group=1),
    Action("save_version", PALETTE, "Keep as a version", ("V",), group=2),
    Action("compare_version", PALETTE, "Compare with a version", ("Shift+V",), group=2),
    Action("show_after", VIEW, "After", ("F1",), True),
    Action("show_before", VIEW, "Before", ("F2",), True),
    Action("show_wipe", VIEW, "Wipe", ("F3", "W"), True),
    Action("show_side", VIEW, "Side by side", ("F4",), True),
    Action("compare", VIEW, "Before, while the key is down", ("C",)),
    Action("fit", VIEW, "Fit", ("F",), group=1),
    Action("one_to_one", VIEW, "1:1", ("Ctrl+1",), group=1),
    Action("zoom_in", VIEW, "Zoom in", ("Ctrl++", "Ctrl+="), group=1),
    Action("zoom_out", VIEW, "Zoom out", ("Ctrl+-",), group=1),
    Action("outside", VIEW, "Mark colours outside of the palette", ("X",), True, 2),
    Action("brighter", VIEW, "Exposure up", ("E",), group=3),
    Action("darker", VIEW, "Exposure down", ("Shift+E",), group=3),
    Action("plain_look", VIEW, "Reset exposure and gamma", ("Ctrl+0",), group=3),
    Action("full_screen", VIEW, "Full screen", ("F11",), True, 4),
    Action("play", PLAYBACK, "Play or stop", ("Space",)),
    Action("play_backwards", PLAYBACK, "Play backwards, faster", ("J",)),
    Action("stop", PLAYBACK, "Stop", ("K",)),
    Action("play_forwards", PLAYBACK, "Play forwards, faster", ("L",)),
    Action("next_frame", PLAYBACK, "Next frame", ("Right",), group=1),
    Action("previous_frame", PLAYBACK, "Previous frame", ("Left",), group=1),
    Action("ten_on", PLAYBACK, "Ten frames on", ("Shift+Right",), group=1),
    Action("ten_back", PLAYBACK, "Ten frames back", ("Shift+Left",), group=1),
    Action("next_handle", PLAYBACK, "Next frame with a handle", ("Ctrl+Right",), group=1),
    Action("previous_handle", PLAYBACK, "Previous frame with a handle", ("Ctrl+Left",), group=1),
    Action("first_frame", PLAYBACK, "First frame", ("Home",), group=1),
    Action("last_frame", PLAYBACK, "Last frame", ("End",), group=1),
    Action("mark_in", PLAYBACK, "In point here", ("I",), group=2),
    Action("mark_out", PLAYBACK, "Out point here", ("O",), group=2),
    Action("clear_marks", PLAYBACK, "Remove in and out point", ("Alt+X",), group=2),
    Action("loop", PLAYBACK, "Loop", ("Ctrl+Shift+L",), True, 2),
    Action("first_steps", HELP, "First steps", ()),
    Action("manual", HELP, "Gestures and keys", ("Ctrl+?",)),
    Action("about", HELP, "About palette4d", ()),
)

#: Actions of the timeline and of the solid: `name` is the view's method. Their keys work while
#: the view has the keyboard, their menu entries always.
TIMELINE_ACTIONS = (
    Action("select_all", PALETTE, "Select all handles", ("Ctrl+A",)),
    Action("next_handle", PALETTE, "Next handle", ("Tab",)),
    Action("previous_handle", PALETTE, "Previous handle", ("Shift+Tab",)),
    Action("row_above", PALETTE, "Row above", ("Up",)),
    Action("row_below", PALETTE, "Row below", ("Down",)),
    Action("stop_earlier", PALETTE, "Move the stop a frame earlier", ("Alt+Left",)),
    Action("stop_later", PALETTE, "Move the stop a frame later", ("Alt+Right",)),
    Action("zoom_in", VIEW, "Zoom the timeline in", ("+",)),
    Action("zoom_out", VIEW, "Zoom the timeline out", ("-",)),
    Action("show_all", VIEW, "Show all frames", ("0",)),
)
SOLID_ACTIONS = (
    Action("next_colour", PALETTE, "Next colour of the solid", ("Tab",)),
    Action("reset_view", VIEW, "Look at the solid from the front", ("0",)),
)

#: What the pointer and held keys do: where, the gesture, and what it does.
GESTURES = (
    ("picture", "click", "pick: choose what the colour becomes"),
    ("picture", "drag", "pick the mean colour of a box"),
    ("picture", "Alt-click, Alt-drag", "hold: the colour stays"),
    ("picture", "move the pointer", "see the pixel's values, and its weights on the rows"),
    ("picture", "wheel", "zoom at the pointer"),
    ("picture", "middle button, Shift-drag", "pan"),
    ("picture", "drag the wipe's line", "move the wipe"),
    ("timeline", "click a disc or a row", "select it; Shift or Ctrl adds"),
    ("timeline", "drag over the ground", "select the discs in the box"),
    ("timeline", "move over a disc or a row", "see its weight as a matte over the picture"),
    ("timeline", "double-click a row", "add a stop there"),
    ("timeline", "double-click a disc", "go to its frame"),
    ("timeline", "drag a stop", "move it to another frame; with Alt between frames"),
    ("timeline", "drag an end of a pick's range", "change when the pick acts"),
    ("timeline", "right-click", "the menu of what is there: ramps, locks, fades, …"),
    ("timeline", "click or drag in the ruler or the strip", "move the playhead"),
    ("timeline", "wheel over the ruler, Ctrl-wheel", "zoom at the pointer"),
    ("timeline", "Shift-wheel, middle button", "pan"),
    ("solid", "drag the ground", "turn the solid"),
    ("solid", "drag a colour", "move it in the plane of the screen"),
    ("solid", "X, Y or Z while dragging", "move along red, green or blue alone"),
    ("solid", "Alt-arrows", "move the selected colour by a hundredth"),
    ("solid", "arrows, wheel", "turn, zoom"),
    ("solid", "double-click", "look from the front again"),
    ("inspector", "drag in the wheel", "hue and chroma; Shift keeps the chroma, Ctrl the hue"),
    ("inspector", "drag a bar, type a number", "one of L, C, h, R, G, B"),
    ("inspector", "arrows in the wheel or on a bar", "change it by a step"),
    ("inspector", "Pipette, then click the picture", "take the colour there"),
    ("window", "drop a clip, a sidecar or a manifest", "open it"),
)
