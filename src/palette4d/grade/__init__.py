"""The document: palette and edits, and the one place that writes sidecars."""
