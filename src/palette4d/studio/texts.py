"""All texts of the window, in one place for translation.

A translation replaces the values here, and nothing else; names in braces stay, such as {frame}.
Two kinds of text are not here: messages of the command line, which the status line shows too, and
labels of the history, which are part of the sidecar.
"""

from typing import Literal

TITLE = "palette4d Studio"

# ------------------------------------------------------------------------------------ the session
OPENED = "opened {name}"
CLIP_MISSING = (
    "found no clip at {source}; the palette can be edited. File > Find the clip… shows it"
)
OTHER_SIZE = (
    "the palette was made from a {own} clip, this one is {found}: check that it is the same clip"
)
OWN_CLIP = "File > Find the clip… opens the palette's own"
LACKS_FRAMES = "the clip lacks {count} frames of the palette, the first is {first}"
UNDONE = "undone"
REDONE = "redone"
ANALYSIS_UNDONE = "the palette before the last analysis is back"
ANALYSIS_REDONE = "the palette of the last analysis is back"
ANALYSIS_STAYS = (
    "another program edited the file, so the analysis stays; take its edits back first, or save "
    "under another name"
)
MERGED = "another program edited the file too; the edits of both are kept"
RELOADED = "another program edited the file; its edits are shown"
BROKEN = "Another program wrote a file that cannot be used; your edits are kept here."
NOT_SAVED = "Not saved:"
KEPT_IN = "Your edits are kept in {copy}; File > Save as… writes them elsewhere"
KEPT_HERE = "Your edits are kept in this window; File > Save as… writes them elsewhere"
SAVED_AS = "saved as {name}"

# ------------------------------------------------------------------------------------- the window
SOLID = "RGB solid"
INSPECTOR = "Inspector"
TIMELINE = "Timeline"
VIEWER = "Viewer"
EMPTY = (
    "Drop a clip or a sidecar here.\n"
    "Click a colour in the picture and choose what it becomes. Alt- or Ctrl-click what must stay."
)
NO_CLIP = "The clip was not found. The palette can be edited without it."
NO_PICTURE, BAD_PICTURE = "no picture", "Frame {frame} cannot be shown."
READING = "reading…"
BEFORE = "before"
AFTER = "after"
NEW_PICK = "choose its new colour"
ALSO, PROPOSED_HOLD, PROPOSED_BOX, PROPOSED_WINDOW = "also", "hold?", "add?", "window?"
NO_MATTE = "{id} has no weight in this frame"
MATTE, MATTE_ENDS = "weight of {id}", ("0 %", "100 %")
PICK_MATTE, DRAFT_MATTE = "matte of {id}", "what a pick here takes"
NO_PICK_MATTE = "{id} does nothing in this frame"
PROBE_IN = "in"
PROBE_OUT = "out"
NO_COLOUR = "there is no colour: the pixels are transparent or not finite"
BAD_FRAME = "Bring a good copy: it is read by itself."
LATE = "frame {shown} is shown; frame {frame} comes…"
NO_FRAME = "the clip has no frame {frame}"
BEYOND = "the clip has no frame {frame}; its frames are {first} to {last}"

# ------------------------------------------------------------------------------- above the picture
BANNER = "Problems"
FIND_CLIP, SAVE_ELSEWHERE, TRY_AGAIN = "Find the clip…", "Save as…", "Try again"
CHANGE, REOPEN = "Change…", "Reopen"
OPEN_COPY, DISCARD_COPY = "Open the copy", "Discard it"
FOLLOW_NOW, UNFOLLOWED = "Follow now", "Not followed through the clip yet: {ids}."
ASSUMED = "The clip does not state its colour space. Its code values are shown as they are."
OTHER_CONFIG = "{problem}. The picture is shown through the config {config}."
CRASHED = "{name} was open in a window that ended without closing. Its edits are in the file."
TRY_SAMPLE = "Try the sample"

# ------------------------------------------------------------------------------- below the picture
FRAME_FIELD = "Frame"
RATE = "{rate} fps"
DROPPED = "{count} dropped"
MARKS = "in {} – out {}"
SHOWS = "shows {name}"
COMPARE = {"after": "After", "before": "Before", "wipe": "Wipe", "side": "Side"}
DISPLAY = "Display and view"
EXPOSURE = "EV"
GAMMA = "γ"
NO_DISPLAY = "no clip"
AS_IS = "code values as they are"
LOOK_TIP = "From {space} through the config {config}"
AS_IS_TIP = "The clip's encoding is unknown, so its code values are shown as they are"

# ------------------------------------------------------------------------------- lists and status
HISTORY = "History"
SHOTS = "Shots"
BEGINNING = "as analysed"
UNDONE_STEP, UNREAD_STEP = "(undone)", "(not followed yet)"
SHOT_STATES = {"done": "palette ready", "failed": "analysis failed", "to do": "not analysed"}
WARNING_SIGN = "Note: "
ERROR_SIGN = "Error: "
SAVED = "saved"
UNSAVED = "not saved yet"
DRAG_OUT = "Drag it out of the window, into a host for example"
SAVED_NOW = "saved"
HANDLES = "{count} handles"
PICKS = "picks {count}"
NO_PALETTE = "no palette yet"
AS_IS_STATUS = "unknown encoding: code values as they are"
LUT_ERROR = "preview LUT error while dragging: {error:.1f}/255"
OUTSIDE, NEARLY_NONE = "{share} of the pixels outside the palette", "<0.1 %"
RECOVERY = "edits that could not be saved are in {copy}"

UNEXPECTED = "something went wrong in the program: {error}. Your edits are kept"

# -------------------------------------------------------------------------------------- the menus
#: The letter after & opens the menu with Alt.
MENUS = {
    "file": "&File",
    "edit": "&Edit",
    "palette": "&Palette",
    "view": "&View",
    "playback": "Play&back",
    "help": "&Help",
}
#: The entries of the menus: of the window, and of the views that have the keyboard.
ACTIONS = {
    "window": {
        "open": "Open…",
        "find_clip": "Find the clip…",
        "save": "Save",
        "save_as": "Save as…",
        "revert": "Load the file again",
        "analyze": "Analyse…",
        "analyze_again": "Analyse again, keep edits…",
        "render": "Render…",
        "bake": "Bake a LUT…",
        "export": "Export LUTs over time…",
        "config": "OpenColorIO config…",
        "install": "Install the node…",
        "next_shot": "Next shot",
        "previous_shot": "Previous shot",
        "copy_grade": "Copy this grade to a shot…",
        "quit": "Quit",
        "undo": "Undo",
        "redo": "Redo",
        "cancel": "Cancel, select nothing",
        "reset_selected": "Reset the selected handles",
        "reset_all": "Reset everything",
        "preferences": "Preferences…",
        "add_stop": "Add a stop at the playhead",
        "lock": "Lock or unlock the selected",
        "hold_pixel": "Hold the colour under the pointer",
        "pick_pixel": "Pick the colour under the pointer",
        "cross": "A cross that arrows move over the picture",
        "act_from": "The selected pick acts from here on",
        "act_until": "The selected pick acts until here",
        "ramp_linear": "Ramp: linear",
        "ramp_smooth": "Ramp: smooth",
        "ramp_hold": "Ramp: step",
        "save_version": "Keep as a version",
        "compare_version": "Compare with a version",
        **{f"version_{n}": f"Use version {n}" for n in range(1, 10)},
        "switch": "A/B: switch between before and after",
        "show_after": "After",
        "show_before": "Before",
        "show_wipe": "Wipe",
        "show_side": "Side by side",
        "compare": "Before, while the key is down",
        "fit": "Fit",
        "one_to_one": "1:1",
        "zoom_in": "Zoom in",
        "zoom_out": "Zoom out",
        "outside": "Mark colours outside of the palette",
        "matte": "Matte of the selected pick",
        "brighter": "Exposure up",
        "darker": "Exposure down",
        "plain_look": "Reset exposure and gamma",
        "scopes": "Show or hide the scopes",
        "reset_layout": "Reset the layout",
        "full_screen": "Full screen",
        "play": "Play or stop",
        "play_backwards": "Play backwards, faster",
        "stop": "Stop",
        "play_forwards": "Play forwards, faster",
        "next_frame": "Next frame",
        "previous_frame": "Previous frame",
        "ten_on": "Ten frames on",
        "ten_back": "Ten frames back",
        "next_handle": "Next frame with a handle",
        "previous_handle": "Previous frame with a handle",
        "go_to_selected": "Go to the selected handle or pick",
        "first_frame": "First frame",
        "last_frame": "Last frame",
        "mark_in": "In point here",
        "mark_out": "Out point here",
        "clear_marks": "Remove in and out point",
        "loop": "Loop",
        "first_steps": "First steps",
        "manual": "Gestures and keys",
        "about": "About palette4d",
    },
    "timeline": {
        "select_all": "Select all handles",
        "next_handle": "Next handle",
        "previous_handle": "Previous handle",
        "row_above": "Row above",
        "row_below": "Row below",
        "stop_earlier": "Move the stop a frame earlier",
        "stop_later": "Move the stop a frame later",
        "zoom_in": "Zoom the timeline in",
        "zoom_out": "Zoom the timeline out",
        "show_all": "Show all frames",
        "rows_taller": "Taller rows",
        "rows_lower": "Lower rows",
    },
    "solid": {
        "next_colour": "Next colour of the solid",
        "reset_view": "Look at the solid from the front",
    },
}
#: What the pointer and held keys do: where, the gesture, and what it does.
GESTURES = (
    ("picture", "click", "pick: choose what the colour becomes"),
    ("picture", "drag", "pick the main colour of a box"),
    (
        "picture",
        "Alt-click or Ctrl-click",
        "hold: the colour stays; with a drag, the main colour of a box",
    ),
    (
        "picture",
        "Shift-drag, with a pick selected",
        "paint what belongs to it too; a click adds a box",
    ),
    ("picture", "Shift-wheel, with a pick selected", "the brush's size"),
    (
        "picture",
        "drag an edge, a corner or the middle of a window",
        "size or move it; Esc takes that back",
    ),
    ("picture", "drag the dashed line around a window", "how far it fades out"),
    ("picture", "move the pointer", "see the pixel's values, and its weights on the rows"),
    ("picture", "wheel", "zoom at the pointer"),
    (
        "picture",
        "Enter or ., then arrows",
        "move a cross over the picture; Ctrl is finer, Shift farther",
    ),
    ("picture", "Enter or Ctrl-Enter at the cross", "pick or hold there; Esc hides the cross"),
    ("picture", "middle button; Shift-drag without a pick", "pan"),
    ("picture", "drag the wipe's line", "move the wipe"),
    ("timeline", "click a disc or a row", "select it; Shift or Ctrl adds"),
    ("timeline", "drag over the ground", "select the discs in the box"),
    ("timeline", "move over a disc or a row", "see its weight as a matte over the picture"),
    ("timeline", "move over a pick's bar", "see what it takes; so in the list of picks"),
    ("timeline", "double-click a row", "add a stop there"),
    ("timeline", "double-click a disc", "go to its frame"),
    ("timeline", "drag a stop", "move it to another frame; with Alt between frames"),
    ("timeline", "drag an end of a pick's range", "change when the pick acts"),
    (
        "timeline",
        "drag the tip of a fade; Alt- or Ctrl-drag an end",
        "change how long the fades are",
    ),
    ("timeline", "right-click", "the menu of what is there: ramps, locks, fades, …"),
    ("timeline", "click or drag in the ruler or the strip", "move the playhead"),
    ("timeline", "wheel over the ruler, Ctrl-wheel", "zoom at the pointer"),
    ("timeline", "Shift-wheel, middle button", "pan"),
    ("timeline", "Alt-wheel", "make the rows taller or lower"),
    ("solid", "drag the ground", "turn the solid"),
    ("solid", "drag a colour", "move it in the plane of the screen"),
    ("solid", "X, Y or Z while dragging", "move along red, green or blue only"),
    ("solid", "Alt-arrows", "move the selected colour by a hundredth"),
    ("solid", "arrows, wheel", "turn, zoom"),
    ("solid", "double-click", "look from the front again"),
    ("inspector", "drag in the wheel", "hue and chroma; Shift keeps the chroma, Ctrl the hue"),
    ("inspector", "drag a bar, type a number", "one of L, C, h, R, G, B"),
    ("inspector", "arrows in the wheel or on a bar", "change it by a step"),
    ("inspector", "Pipette, then click the picture", "take the colour there"),
    ("window", "drag the file's name out of the status line", "give the sidecar to a host"),
    ("window", "drop a clip, a sidecar or a manifest", "open it"),
)
RECENT = "Recent"
VERSIONS = "Versions"
NOTHING_YET = "nothing yet"
OPEN_TITLE = "Open a clip, a sidecar or a manifest"
OPEN_FILTER = "Clips, sidecars and manifests (*)"
FIND_TITLE = "Find the clip"
CLIP_FILTER = "Clips (*)"
SAVE_TITLE = "Save as"
SIDECAR_FILTER = "Sidecars (*.p4d.json)"
CLOSE_ANYWAY = "{why}\n\nSave elsewhere, or close and discard the edits?"
RESET_ALL = "everything is reset"
WAS_LOCKED, WAS_UNLOCKED = "locked {ids}", "unlocked {ids}"
SELECT_A_HANDLE = "select a vertex or a stop first"
SELECT_ONE = "select a handle, a pick or a hold first"
SELECT_A_PICK = "select a pick or a hold first"
POINT_AT = "point at a pixel first"
KEPT_VERSION = "kept as version {name}"
USES_VERSION = "version {name}"
NO_VERSION = "there is no version {number}; V keeps one"
RENAMED_VERSION = "version {name} is {new} now"
NOTED = "the note of version {name} is kept"
REMOVED_VERSION = "removed version {names}; undo brings it back"
NO_VERSIONS_LONG = "No versions yet.\nKeep the grade as a version, and compare it with others here."
NOTE_HINT = "Note of the selected version"
GALLERY_USED = "The grade is this version."
GALLERY_BUTTONS = {
    "keep": ("Keep", "Keep the grade as a version (V)"),
    "use": ("Use", "Make it the grade (double-click, Enter)"),
    "compare": ("Wipe", "Wipe between it and the grade; of two versions: between these"),
    "rename": ("Rename", "Give it another name (F2)"),
    "delete": ("Delete", "Remove the selected versions (Del); undo brings them back"),
}
THE_GRADE, A_VERSION = "the grade", "version {name}"
COMPARES = "before shows {}, after shows {}"
NO_VERSIONS = "no versions yet: V keeps one"
NO_OTHER_VERSION = "no version differs from this grade; before shows the source"
COMPARED = "before shows version {name}"
COMPARED_SOURCE = "before shows the source"

# --------------------------------------------------------------------------------------- the work
SAME_COMMAND = "The same on the command line:"
COPY = "Copy"
CLOSE = "Close"
STOP_JOB = "Stop"
STOP_ASKED = "Stop what is running? Files that are not finished are removed."
GO_ON = "Let it run"
MORE = "More"
CHOOSE = "Choose…"
RUNNING = "running"
STOPPING = "stopping"
CANCELLED = "stopped; finished files are kept, the unfinished one was removed"
DONE = "done"
FAILED = "failed; the reason is below"
ANALYZE = "Analyse"
ELSEWHERE = "the clip's folder cannot be written: {folder} is proposed"
ANALYZE_AGAIN = "Analyse again"
RENDER = "Render"
BAKE = "Bake"
EXPORT = "Export"
CONFIG_WORK = "Write the config"
INSTALL = "Install"
COPY_GRADE = "Copy the grade"
COPY_TITLE = "Copy this grade to"
TO_SHOT = "To"
FROM_SHOT = "From"
SHOT_NAMES = "Shots with these names"
ACTION = "Action"
CLIP = "Clip"
CLIP_HINT = "shot.####.exr, a folder, an image or a movie"
SHOW = "Edit"
SIDECAR = "Sidecar"
OUTPUT = "Output"
FOLDER = "Folder"
FRAMES_HINT = "all; or, for every second one, {}-{}x2"
VERTICES_HINT = "all that are worth it"
SPACE_HINT = "as the file says"
EDITS = "Edits of an existing sidecar"
EDITS_NAMES = ("refuse if there are any", "keep", "drop")
MEDIA_HINT = "the paths in the edit"
RATE_HINT, EDL_RATE_HINT = "the clip's", "24"
HEAD_TAIL_HINT, ONLY_HINT = "0", "all shots"
CONFORM_HINT = "by the rates"
LIKE_HINT = "no: a new palette"
METHOD_HINT = "the best palette (skew)"
MATRIX_HINT = "what the movie states; else 709 for HD, 601 for SD"
LAYER_HINT = "of an EXR with several"
SETTINGS = "Settings"
SETTINGS_HINT = "NAME=VALUE, see palette4d analyze --help-all"
COMPARE_LABEL = "With the source"
BITS_HINT = "as the clip"
NO_COMPARE = "no"
CODEC_HINT = "by the extension"
CRF_HINT = "14; 0 is lossless"
MISSING = "A missing frame shows"
MISSING_HINT = "the frame before"
FORMAT_HINT = "by the extension"
SIZE_HINT = "33, or 65 with picks"
SHAPER_HINT = "auto"
DOMAIN_HINT = "LOW HIGH; the frame and the palette"
LUT_SPACE_HINT = "the clip's"
LUT_CLIP_HINT = "the sidecar's"
NO_EVERY_HINT = "1-100x10, in place of every n-th"
BASE_HINT = "ACES studio"
PROCESS_SPACE_HINT = "by the sidecar's encoding"
MIDDLE_HINT = "the middle frame alone"
NAMES_HINT = "the clips' names"
ALSO_DONE = "Also shots that have a sidecar"
LINK = "Link, do not copy"
#: Buttons for advised options that have a short word.
OFFERS = {"--allow-cuts": "Allow", "--skip-bad-frames": "Skip these frames"}
#: The fields that arguments of the API have in the dialogs, by name or with their value.
FIELDS = {
    'on_edits="keep"': f"{EDITS}: {EDITS_NAMES[1]}",
    'on_edits="drop"': f"{EDITS}: {EDITS_NAMES[2]}",
    "detect_shots": "Split at cuts; one sidecar per shot",
    "frames": "Frames",
    "frame": "Frame",
    "rate": "Frames per second",
    "handles": "Head and tail frames",
    "only": "Shots",
    "conform": "Movies of other rates play",
    "skip_bad_frames": "Skip bad frames",
    "allow_cuts": "Allow cuts",
    "input_space": "Clip's colour space",
    "palette_space": "Palette's colour space",
    "process_space": "Clips' colour space in the config",
    "space": "LUT's colour space",
    "ocio_config": "OpenColorIO config",
    "matrix": "Y'CbCr matrix",
    "layer": "Layer",
    "vertices": "Most handles",
    "method": "Method",
    "like": "Keep the colours of a sidecar",
    "media": "Folder of the media",
    "clip": "Clip",
    "force": "Replace existing files",
    "skip_existing": "Keep finished files",
    "half": "Half floats (EXR)",
    "bits": "Bits per sample",
    "codec": "Codec",
    "crf": "Quality (CRF)",
    "format": "Format",
    "size": "Samples per side",
    "shaper": "Shaper",
    "domain": "Shaper covers",
    "every": "Every n-th frame",
    "stops": "Where the edit turns",
    "names": "Names of the shots",
    "anyway": "Write it even if frames between differ",
    "base": "Config to extend",
    "dest": "Folder",
    "link": LINK,
}

# --------------------------------------------------------------------------------------- the help
FIRST_STEPS = "First steps"
FIRST_STEPS_TEXT = (
    "1. Drop a clip on the window. Its palette is found in some seconds.\n"
    "2. Click a colour in the picture and choose what it becomes.\n"
    "3. Shift-drag over what belongs to it too. Alt- or Ctrl-click what must stay as it is.\n"
    "4. W shows before and after. Ctrl+Z undoes. Everything is saved by itself."
)
MANUAL = "Gestures and keys"
MANUAL_COLUMNS = ("where", "do this", "and")
SEARCH = "Search"
SHORTCUTS = "Keys"
PREFERENCES, GENERAL = "Preferences", "General"
DEFAULT_DISPLAY, OWN_DISPLAY = "Display", "the config's default"
RECENT_FILES, FORGET, LAYOUT = "Recent files", "Forget", "Panels"
SHORTCUT_COLUMNS = ("menu", "action", "keys")
SEARCH_KEYS = "Search an action or a key"
KEYS = "Keys of the selected action"
KEY_TAKEN = "{key} is taken from “{name}” then"
RESET_KEYS = "Reset all keys"
IN_TIMELINE, IN_SOLID = "(in the timeline)", "(in the solid)"
USE_A_VERSION = "Use a version"
ABOUT = "palette4d {version}\nTime-varying palettes for colour grading\n(Du et al., SIGGRAPH 2021)"

# ------------------------------------------------------------------------------------ the timeline
NOTHING_OPEN = "Nothing is open."
FRAME = "frame"
WEIGHT = "weight"
VERTEX = "vertex"
STOP = "stop"
ADD_STOP_AT = "Add a stop at frame {frame}"
REMOVE_STOP = "Remove the stop"
LOCK, UNLOCK = "Lock", "Unlock"
ACTS = "Acts"
SAME_COLOUR = "The same new colour in all frames"
SAME_COLOUR_TIP = "Where its light changes too; else it gets the same change in all frames"
FADE = "Fades, before and after the range"
FADE_OF, NO_FADE = "{frames} frames", "none"
SAME_EVERYWHERE = "{id} becomes the same colour in all frames"
SAME_SHIFT = "{id} shifts by the same offset in all frames"
RESET = "Reset the selected handles"
AT_FRAME = "frame {frame}"
GO_THERE = "Go to frame {frame}"
ROW_TIP = "double-click adds a stop"
STOP_ADDED = "added a stop to {row} at frame {frame}"
STOP_MOVED = "moved {id} to frame {frame}"
NO_STOP_HERE = "no room for a stop on {row} here: choose a frame between two handles"
SELECT_A_ROW = "select a row or a handle first; then S adds a stop at the playhead"
WAS_RESET = "reset {ids}"

# --------------------------------------------------------------------------------------- the solid
SOLID_HINT = "drag to turn · drag a colour: X, Y, Z along R, G, B"
SOLID_AXIS = "along {axis} only"
COLOUR_MOVED = "moved a colour"
CONCAVE_EDGE, CONCAVE_EDGES = "concave edge", "concave edges"
CONCAVE_WHY = "Notched: gradients bend there."
FLIPPED_FACE, FLIPPED_FACES = "face turned inside out", "faces turned inside out"
FLIPPED_WHY = "Hatched: colours cross there, and gradients may fold. If you see it, change less."

# ------------------------------------------------------------------------------------- the scopes
SCOPES_PANEL = "Scopes"
SCOPES_SHOWN = {
    "waveform": "Waveform",
    "parade": "Parade",
    "vectorscope": "Vectorscope",
    "histogram": "Histogram",
}
SCOPE_TIPS_SHOWN = {
    "waveform": "Luma of each column of the picture; 0 and 1023 are black and white",
    "parade": "Red, green and blue of each column of the picture",
    "vectorscope": "Hue and chroma, with the line of skin tones and the picks' colours",
    "histogram": "How many pixels have which red, green and blue",
}
SCOPE_ZOOM, SCOPE_ZOOM_TIP = "2×", "Enlarge the vectorscope"
NO_SCOPE, NOTHING_MEASURED = "Choose a scope above.", "no picture"
GHOST = "line: before"

# ----------------------------------------------------------------------------------- the inspector
NOTHING_SELECTED = "Nothing is selected"
SELECT_HINT = "Click a colour in the picture, a disc or a row."
EDGE = "row"
AND_MORE = " and {count} more"
SCOPES: dict[Literal["handle", "track", "palette"], str] = {
    "handle": "Handle",
    "track": "Track",
    "palette": "Palette",
}
SCOPE_TIPS = {
    "handle": "A new colour changes the selected handles",
    "track": "A new colour changes the whole track of the selected colour",
    "palette": "A new colour shifts the whole palette by the same offset",
}
RAMP = "Ramp"
RAMP_TIP = "How the colour goes to the next handle; with nothing selected: the clip's default"
RAMP_OF_CLIP = "The clip's ramp"
RAMPS = {"linear": "linear", "smooth": "smooth", "hold": "step"}
RAMP_SET = "ramp: {ramp}"
WHEEL = "Hue and chroma"
WHEEL_TIP = "Drag: hue and chroma. Shift keeps the chroma, Ctrl the hue."
LIGHTNESS = "Lightness (OKLCh)"
CHROMA = "Chroma (OKLCh)"
HUE = "Hue (OKLCh, degrees)"
RED, GREEN, BLUE = "Red code value", "Green code value", "Blue code value"
HEX = "Hex"
HEX_TIP = "The code values of the clip, 8 bits a channel"
ON_SCREEN = "shown"
SHOWN_TIP = "What the screen shows, through the display and view"
EYEDROPPER = "Pipette"
EYEDROPPER_TIP = "Then click the picture: the selected colour becomes the colour there"
RESET_SHORT = "Reset"
SET_BY_SCOPE = {
    "handle": "set {id}",
    "track": "moved the track of {id}",
    "palette": "moved the palette",
}
PLACE = "pixel {x}, {y}"
PLACE_HINT = "choose what it becomes"
PICK, HOLD = "pick", "hold"
PICKED, PICK_SET = "the colour is picked", "{id} has a new colour"
HELD = "the colour is held"
LEARNING = "reading the clip…"
STILL_FOLLOWING = "an edit is still followed through the clip; try again when that is done"
CLOSES_SOON = "Studio closes when the edit is followed; close it again to leave it as it is"
NOT_FOLLOWED = "kept, but not followed through the clip: {why}"
FOLLOWED = "followed: {step}"
FOLLOWING = "following through the clip: {done} of {total} frames"
PICK_LIST = "Picks, holds and locks"
ALL_FRAMES = "all frames"
LOCKED = "{id} is locked"
LOCKED_MOVED = "locked against picks, but changed by hand: {ids}"
RANGE_SET = "{id} acts from frame {start} to {until}"
PICK_TIP = "from frame {} to {}, {}; the picture shows what it takes"
PICK_SHAPED = "the matte of {id} is changed"
REACH, SOFTNESS, LIGHTNESS_RANGE = "Reach", "Softness", "Lightness"
REACH_TIP = "Above 0 it takes more colours, below 0 fewer"
SOFTNESS_TIP = "How soft the edge of its matte is"
LIGHTNESS_TIP = (
    "Only this range of lightness changes. Up and Down choose the end that the arrows move"
)
WINDOW = "Window"
WINDOW_TIP = "It changes only what is in a box over the picture, which is followed through the clip"
#: The numbers of a window, in pixels of the clip: their names, and what they are.
WINDOW_NUMBERS = {
    "x": ("X", "The window's left edge, in pixels from the picture's"),
    "y": ("Y", "The window's top, in pixels from the picture's"),
    "width": ("W", "The window's width in pixels"),
    "height": ("H", "The window's height in pixels"),
}
INVERT = "Invert"
INVERT_TIP = "It changes all but what is in the window"
INVERTED = ("{id} changes what is in its window", "{id} changes all but what is in its window")
FEATHER = "Feather"
FEATHER_TIP = "Over how many pixels the change fades out beyond the window"
WINDOW_LOST = (
    "What is in the window is lost until frame {frame}. Go there and drag the window onto it.",
    "What is in the window is lost from frame {frame} on. Go there and drag the window onto it.",
)
WINDOW_SET = "window of {id} at frame {frame}"
WINDOW_REMOVED = "{id} has no window: it changes all of the picture"
REMOVE_BOX = "Remove the box of frame {frame}"
REMOVE_BOX_TIP = "The window is followed from its other boxes alone"
BOX_REMOVED = "window of {id}: no box at frame {frame}"
FEATHER_SET = "window of {id}: a feather of {pixels} pixels"
WHOLE_HUE = "All of its hue"
WHOLE_HUE_TIP = "It takes every colour of its hue, like a hue qualifier"
ITS_HUE, ITS_COLOURS = "{id} takes all of its hue", "{id} takes the colours of its place"
ADD_TO_IT = "Add to it"
ADD_TO_IT_TIP = (
    "Then paint over what else belongs to it; a click adds a box. Shift-drag does the same"
)
HOLD_TOOL = "Hold…"
HOLD_TOOL_TIP = "Then click in the picture what must stay. Alt-click does the same"
MATTE_BUTTON = "Matte"
MATTE_TIP = "Show what it takes; the rest is dark and grey (M)"
AREA_ADDED = "{id} has learned what was added"
LOOKING = "measuring what it takes…"
TAKES, KEEPS = "Takes {share} of frame {frame}.", "Keeps {share} of frame {frame}."
JUDGED = "That is where it was picked; it does not act there."
NOT_HERE = "It does not act at frame {frame}, shown now."
HERE, HERE_TOOL = "Of frame {frame}, shown now: {share}.", "It is here…"
HERE_TOOL_TIP = "Then click where it is in this frame; it is followed again from there too"
CORRECTED = "{id} goes through the pixel at frame {frame}"
NOTE_AT = ", at {x}, {y}"
ADD_GESTURE = {"hold": "Add this hold", "area": "Add this box", "window": "Add this window"}
ENABLED, DISABLED = "{ids} acts again", "{ids} does not act"
REMOVE = "Remove"
REMOVED = "removed {ids}"
USED = "●"
