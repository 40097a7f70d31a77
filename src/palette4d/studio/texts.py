"""All texts of the window, in one place for translation."""

from typing import Literal

TITLE = "palette4d Studio"

# ------------------------------------------------------------------------------------ the session
OPENED = "opened {name}"
CLIP_MISSING = (
    "found no clip at {source}; the palette can be edited. File > Find the clip… shows it"
)
UNDONE = "undone"
REDONE = "redone"
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
    "Drop a clip or a sidecar here, or choose File > Open.\n\n"
    "Click a colour in the picture and choose what it becomes. Alt-click a colour that must stay.\n"
    "The rows below are the palette through time: drag, double-click, undo as you like."
)
NO_CLIP = "The clip was not found. File > Find the clip… shows the picture."
READING = "reading…"
BEFORE = "before"
AFTER = "after"
PROBE_IN = "in"
PROBE_OUT = "out"
NO_COLOUR = "there is no colour: the pixels are transparent or not finite"
NO_FRAME = "the clip has no frame {frame}"

# ------------------------------------------------------------------------------- below the picture
FRAME_FIELD = "Frame"
RATE = "{rate} fps"
DROPPED = "{count} dropped"
MARKS = "in {} – out {}"
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
UNDONE_STEP = "(undone)"
SHOT_STATES = {"done": "palette ready", "failed": "analysis failed", "to do": "not analysed"}
WARNING_SIGN = "Note: "
ERROR_SIGN = "Error: "
SAVED = "saved"
UNSAVED = "not saved yet"
SAVED_NOW = "saved"
HANDLES = "{count} handles"
PICKS = "picks {count}"
NO_PALETTE = "no palette yet"
AS_IS_STATUS = "unknown encoding: code values as they are"
LUT_ERROR = "while moving within {error:.1f}/255 of the view"
OUTSIDE = "{share:.1%} of the pixels outside"
RECOVERY = "edits that could not be saved are in {copy}; File > Open loads them"

UNEXPECTED = "something went wrong in the program: {error}. Your edits are kept"

# -------------------------------------------------------------------------------------- the menus
RECENT = "Recent"
VERSIONS = "Versions"
NOTHING_YET = "nothing yet"
OPEN_TITLE = "Open a clip, a sidecar or a manifest"
OPEN_FILTER = "Clips, sidecars and manifests (*)"
FIND_TITLE = "Find the clip"
CLIP_FILTER = "Clips (*)"
SAVE_TITLE = "Save as"
SIDECAR_FILTER = "Sidecars (*.p4d.json)"
CLOSE_ANYWAY = "{why}\n\nClose anyway?"
RESET_ALL = "everything is reset"
LOCK = "lock"
POINT_AT = "point at a pixel first"
KEPT_VERSION = "kept as version {name}"
USES_VERSION = "version {name}"
NO_VERSION = "there is no version {number}; V keeps one"
NO_VERSIONS = "no versions yet: V keeps one"
COMPARED = "before shows version {name}"
COMPARED_SOURCE = "before shows the source"

# --------------------------------------------------------------------------------------- the work
SAME_COMMAND = "The same on the command line:"
COPY = "Copy"
CLOSE = "Close"
STOP_JOB = "Stop"
CHOOSE = "Choose…"
RUNNING = "running"
STOPPED = "stopped"
DONE = "done"
FAILED = "failed; the reason is below"
ANALYZE = "Analyse"
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
ACTION = "Action"
CLIP = "Clip"
CLIP_HINT = "shot.####.exr, a folder, an image or a movie"
SIDECAR = "Sidecar"
OUTPUT = "Output"
FOLDER = "Folder"
FRAMES = "Frames"
FRAMES_HINT = "all, or 1001-1100x2"
VERTICES = "Most handles"
VERTICES_HINT = "all that are worth it"
INPUT_SPACE = "Clip's colour space"
PALETTE_SPACE = "Palette's colour space"
SPACE_HINT = "as the file says"
CONFIG = "OpenColorIO config"
BASE_CONFIG = "Config to extend"
KEEP_EDITS = "Keep the edits"
SKIP_BAD = "Skip bad frames"
ALLOW_CUTS = "Allow cuts"
COMPARE_LABEL = "With the source"
BITS = "Bits a sample"
HALF = "Half floats (EXR)"
FORCE = "Replace existing files"
GRID = "Grid points"
EVERY = "Every n-th frame"
FORMAT = "Format"
LINK = "Link, do not copy"

# --------------------------------------------------------------------------------------- the help
FIRST_STEPS = "First steps"
FIRST_STEPS_TEXT = (
    "1. Drop a clip on the window. Its palette is found in some seconds.\n"
    "2. Click a colour in the picture and choose what it becomes.\n"
    "3. Alt-click what must stay as it is.\n"
    "4. W shows before and after. Ctrl+Z undoes. Everything is saved by itself."
)
MANUAL = "Gestures and keys"
ABOUT = "palette4d {version}\nTime-varying palettes for colour grading\n(Du et al., SIGGRAPH 2021)"

# ------------------------------------------------------------------------------------ the timeline
NOTHING_OPEN = "Nothing is open."
FRAME = "frame"
WEIGHT = "weight"
VERTEX = "vertex"
STOP = "stop"
ADD_STOP_AT = "Add a stop at frame {frame}"
REMOVE_STOP = "Remove the stop"
LOCK_ENTRY = "Lock or unlock"
COUNTS = "Counts"
PALETTE_ONLY = "By the palette alone, no local remainder"
SAME_COLOUR = "The same new colour in all frames"
FADE, FADE_OF = "Fade", "{frames} frames"
PICK_CHANGED = "changed {id}"
RESET = "Reset the selected handles"
GO_THERE = "Go to frame {frame}"
ROW_TIP = "edge {id}: double-click adds a stop"
STOP_ADDED = "added a stop to {edge} at frame {frame}"
STOP_MOVED = "moved {id} to frame {frame}"
NO_STOP_HERE = "no room for a stop on {edge} here: choose a frame between two handles"
SELECT_A_ROW = "select a row or a handle first; then S adds a stop at the playhead"
WAS_RESET = "reset {ids}"

# --------------------------------------------------------------------------------------- the solid
SOLID_HINT = "drag to turn · drag a colour: X, Y, Z along R, G, B"
SOLID_AXIS = "along {axis} alone"
COLOUR_MOVED = "moved a colour"
CONCAVE_EDGE, CONCAVE_EDGES = "concave edge", "concave edges"
FLIPPED_FACE, FLIPPED_FACES = "face turned inside out", "faces turned inside out"

# ----------------------------------------------------------------------------------- the inspector
NOTHING_SELECTED = "Nothing is selected"
SELECT_HINT = "Click a disc, a row, or a colour of the solid."
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
    "palette": "A new colour changes the whole palette by the same way",
}
RAMP = "Ramp"
RAMP_TIP = "The way from this handle to the next; without a selection: the clip's"
RAMP_OF_CLIP = "as the clip"
RAMPS = {"linear": "linear", "smooth": "smooth", "hold": "hold"}
RAMP_STEP = "ramp {ramp}"
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
PICKED = "the colour is picked"
HELD = "the colour is held"
FOLLOWING = "following the colour: {done} of {total} frames"
PICK_LIST = "Picks, holds and locks"
PICK_COLUMNS = ("id, kind, frame", "off by", "palette")
MET, NOT_MET = "✓", "⚠"
LOCKED = "{id} is locked"
RANGE_SET = "{id} acts from frame {start} to {until}"
PICK_TIP = "from frame {} to {}, fades of {} frames; “palette” is its share of the change"
ENABLED, DISABLED = "{id} counts again", "{id} does not count"
REMOVE = "Remove"
REMOVED = "removed {ids}"
KEEP = "Keep"
KEEP_TIP = "Keep these edits as a version"
USED = "●"
USE_TIP = "Use version {name} (key {number})"
