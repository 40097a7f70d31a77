"""The pages: every command parses, every link leads somewhere, and no line is too long."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from palette4d.cli.main import build_parser

PAGES = ["README.md", "CONTRIBUTING.md", "benchmarks/README.md"]


def pages(repo_root: Path) -> list[Path]:
    return [repo_root / name for name in PAGES] + sorted((repo_root / "docs").rglob("*.md"))


def test_lines_have_at_most_100_columns(repo_root: Path) -> None:
    found = [
        f"{page.name}:{number}"
        for page in [*pages(repo_root), repo_root / "CHANGELOG.md"]
        for number, line in enumerate(page.read_text("utf-8").splitlines(), 1)
        if len(line) > 100
    ]
    assert not found


def commands(text: str) -> list[list[str]]:
    """The words after `palette4d` of each indented command, without pipes and comments."""
    lines = re.sub(r"\\\n\s*", "", text)
    found = []
    for line in re.findall(r"^ {4}(?:sudo )?palette4d (.*)$", lines, re.MULTILINE):
        lexer = shlex.shlex(line, posix=True, punctuation_chars="|><;&")
        lexer.whitespace_split, lexer.commenters = True, "#"
        words = list(lexer)
        end = next((i for i, word in enumerate(words) if set(word) <= set("|><;&")), len(words))
        found.append(words[:end])
    return found


def test_every_command_is_one(repo_root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parser = build_parser()
    shown = [(page, words) for page in pages(repo_root) for words in commands(page.read_text())]
    assert len(shown) > 50
    for page, words in shown:
        try:
            parser.parse_args(words)
        except SystemExit:
            said = capsys.readouterr().err.strip().splitlines()[-1]
            pytest.fail(f"{page.name}: palette4d {shlex.join(words)}: {said}")


def anchors(text: str) -> set[str]:
    """What links may name of a page: its headings as GitHub writes them."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_every_link_leads_somewhere(repo_root: Path) -> None:
    files, places = 0, 0
    for page in pages(repo_root):
        for target, place in re.findall(
            r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)", page.read_text("utf-8")
        ):
            if "://" in target:
                continue
            there = page.parent / target if target else page
            assert there.exists(), f"{page.name}: {target}"
            files += bool(target)
            if place:
                assert place in anchors(there.read_text("utf-8")), f"{page.name}: {target}#{place}"
                places += 1
    assert files > 20
    assert places > 2
