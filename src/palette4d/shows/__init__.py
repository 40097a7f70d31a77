"""Many shots: edits, manifests, and what is done for all shots of a show."""
