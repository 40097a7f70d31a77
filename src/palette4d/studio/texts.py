"""All texts of the window, in one place for translation."""

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
