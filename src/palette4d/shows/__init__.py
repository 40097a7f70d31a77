"""Many shots: edits, manifests, and the analysis and export of all shots of a show."""
