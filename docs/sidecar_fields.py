"""Write the lists of fields of docs/sidecar.md and docs/files.md from the JSON Schemas.

python docs/sidecar_fields.py            writes the lists into the pages
python docs/sidecar_fields.py --check    exits 1 when a page is not up to date
"""

import json
import sys
import textwrap
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
SCHEMAS = ROOT / "src" / "palette4d"
PAGE = ROOT / "docs" / "sidecar.md"
PAGES = {
    PAGE: SCHEMAS / "sidecar_v2.schema.json",
    ROOT / "docs" / "files.md": SCHEMAS / "shots_v1.schema.json",
}
BEGIN = "<!-- begin: written by python docs/sidecar_fields.py -->"
END = "<!-- end: written by python docs/sidecar_fields.py -->"

Node = dict[str, Any]


def listed(schema: Node) -> str:
    """Return the Markdown list of every member that the schema names, 100 columns wide."""
    rows = []
    for path, kind, span, text in fields(schema):
        row = f"- `{path}`: {kind}{f', {span}' if span else ''}. {text}"
        rows.append(textwrap.fill(row, 100, subsequent_indent="  ", break_on_hyphens=False))
    return "\n".join(rows)


def fields(schema: Node) -> list[tuple[str, str, str, str]]:
    """Return path, type, range and meaning of every member, in the order of the file."""
    found: list[tuple[str, str, str, str]] = []
    _walk(schema, _resolved(schema, schema), "", found)
    return found


def _resolved(schema: Node, node: Node) -> Node:
    while "$ref" in node:
        target = schema["$defs"][node["$ref"].removeprefix("#/$defs/")]
        node = {**target, **{key: value for key, value in node.items() if key != "$ref"}}
    return node


def _walk(schema: Node, node: Node, path: str, found: list[tuple[str, str, str, str]]) -> None:
    for name, member in node.get("properties", {}).items():
        member = _resolved(schema, member)
        here = f"{path}.{name}" if path else name
        found.append((here, _type(schema, member), _range(schema, member), member["description"]))
        inner = member
        while inner.get("type") == "array" and isinstance(inner.get("items"), dict):
            inner = _resolved(schema, inner["items"])
            here += "[]"
        # A version's edits are explained where the file's edits are.
        if (path, name) != ("versions[]", "edits"):
            _walk(schema, inner, here, found)


def _type(schema: Node, node: Node) -> str:
    node = _resolved(schema, node)
    if "const" in node:
        return "text" if isinstance(node["const"], str) else "integer"
    if "enum" in node:
        return "text"
    if "anyOf" in node:
        return "object"
    kind = node["type"]
    if kind == "array":
        if "prefixItems" in node:
            count, item = str(len(node["prefixItems"])), node["prefixItems"][0]
        else:
            fixed = node.get("maxItems", 0) == node.get("minItems")
            count, item = str(node["maxItems"]) if fixed else "", node["items"]
        of = _type(schema, item)
        return f"{count} × {of}" if count else f"list of {of}"
    names = {
        "string": "text" if "pattern" not in node or node.get("format") == "name" else "id",
        "object": "object",
        "boolean": "true or false",
    }
    return names.get(kind, kind) if isinstance(kind, str) else "number, text, true, false or null"


def _range(schema: Node, node: Node) -> str:
    if "const" in node:
        return f"`{json.dumps(node['const'])}`"
    if "enum" in node:
        return ", ".join(f"`{json.dumps(value)}`" for value in node["enum"])
    if node.get("type") == "array":
        item = node["prefixItems"][0] if "prefixItems" in node else node["items"]
        inner = _range(schema, _resolved(schema, item))
        fixed = "prefixItems" in node or node.get("minItems") == node.get("maxItems")
        parts = [f"each {inner}" if inner and not inner.startswith("each ") else inner]
        if not fixed and "maxItems" in node:
            parts.append(f"{node.get('minItems', 0)} to {node['maxItems']}")
        elif not fixed and "minItems" in node:
            parts.append(f"at least {node['minItems']}")
        return "; ".join(part for part in reversed(parts) if part)
    if "minimum" in node and "maximum" in node:
        return f"{node['minimum']} to {node['maximum']}"
    return f"from {node['minimum']}" if "minimum" in node else ""


def written(page: str, schema: Node) -> str:
    """Return the page with its list rewritten."""
    head, rest = page.split(BEGIN)
    _, tail = rest.split(END)
    return f"{head}{BEGIN}\n{listed(schema)}\n{END}{tail}"


def main() -> int:
    """Write or check the pages."""
    late = 0
    for path, schema in PAGES.items():
        page = path.read_text(encoding="utf-8")
        new = written(page, json.loads(schema.read_text(encoding="utf-8")))
        if "--check" not in sys.argv[1:]:
            path.write_text(new, encoding="utf-8")
        elif new != page:
            print(f"{path} is not up to date; run: python docs/sidecar_fields.py", file=sys.stderr)
            late = 1
    return late


if __name__ == "__main__":
    sys.exit(main())
