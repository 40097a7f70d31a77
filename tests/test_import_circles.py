"""No module imports another one that imports it, also not inside functions or for types alone."""

import ast
import functools
import itertools
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {"palette4d": "src/palette4d", "palette4d.analysis": "analysis"}
PACKAGES["palette4d.lut_export"] = "lut_export"


@functools.cache
def modules() -> dict[str, ast.Module]:
    """The package's modules by name; not its public API, which imports what it offers."""
    found = {}
    for package, folder in PACKAGES.items():
        for path in (ROOT / folder).rglob("*.py"):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            name = ".".join((package, *parts)).removesuffix(".__init__")
            found[name] = ast.parse(path.read_text("utf-8"))
    del found["palette4d"]
    return found


def imported(tree: ast.AST, known: set[str], types: bool) -> Iterator[str]:
    """Yield the modules that a module imports, anywhere in it."""
    for node in ast.iter_child_nodes(tree):
        for_types = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        if isinstance(node, ast.Import):
            yield from known & {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield from known & {inner if inner in known else str(node.module)}
        elif types or not for_types:
            yield from imported(node, known, types)


def circles(types: bool) -> list[str]:
    """The modules that import themselves by way of others."""
    trees = modules()
    imports = {name: {*imported(tree, {*trees}, types)} - {name} for name, tree in trees.items()}
    while True:  # what imports nothing, or is imported by none, is in no circle
        wanted = set().union(*imports.values())
        ends = {n for n, others in imports.items() if n not in wanted or not others & {*imports}}
        if not ends:
            return sorted(imports)
        imports = {name: others for name, others in imports.items() if name not in ends}


def test_no_circles() -> None:
    assert circles(types=False) == []


def test_grades_have_none_for_types_either() -> None:
    assert [name for name in circles(types=True) if ".grade." in name] == []


def test_a_circle_is_found() -> None:
    names = {"a", "b", "b.c"}
    inner = ast.parse("def f():\n    from b import c, d\n    import a")
    assert {*imported(inner, names, False)} == {"a", "b", "b.c"}  # d is no module
    typing = ast.parse("if TYPE_CHECKING:\n    import a")
    assert [*imported(typing, names, False)] == []
    assert [*itertools.islice(imported(typing, names, True), 2)] == ["a"]
