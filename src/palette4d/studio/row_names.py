"""One name for a row of the timeline, wherever it is told. It knows no toolkit.

A row has the name of its first disc, as the timeline writes it: "v5 red". Ids of edges, of which a
row may have several, are for files and the command line.
"""

import re

from palette4d.grade.document import Document

#: An id in a text; not a colour such as #e63333.
ID = re.compile(r"(?<![#\w])[a-z]+\d+\b")


def row_name(document: Document | None, id: str) -> str:
    """Return the name of a vertex or a stop, or of the row that an edge is part of."""
    if document is None:
        return id
    grade = document.grade
    rows = {edge: track.name for track in grade.tracks for edge in track.edges}
    first = rows.get(id, id)
    return f"{first} {grade.colour_names.get(first, '')}".rstrip()


def with_row_names(document: Document, text: str) -> str:
    """Return a text with the names of the rows in place of their edges' ids."""
    edges = document.grade.handles.edges
    return ID.sub(lambda m: row_name(document, m[0]) if m[0] in edges else m[0], text)
