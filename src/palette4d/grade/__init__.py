"""The document (palette and edits), and the only code that writes sidecars."""
