"""Configs of OpenColorIO: what they say on the way passes through Python."""

import io
import sys
from pathlib import Path

import pytest

from palette4d.colour.ocio_config import load_config

CONFIG = """ocio_profile_version: 2
"f\\e[31mred": 3
roles: {default: raw, scene_linear: raw}
displays: {sRGB: [!<View> {name: Raw, colorspace: raw}]}
colorspaces: [!<ColorSpace> {name: raw}]
"""


def test_warnings_are_printed_by_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """The command line removes control characters from what Python prints, and only there."""
    path, stream = tmp_path / "config.ocio", io.StringIO()
    path.write_text(CONFIG)
    monkeypatch.setattr(sys, "stderr", stream)
    load_config(str(path), "base=…")
    assert "[31mred" in stream.getvalue()
    assert capfd.readouterr().err == ""
