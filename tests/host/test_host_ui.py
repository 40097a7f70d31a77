"""The files for Kdenlive and Shotcut say of the node's parameters what the node itself says."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.scene import Scene
from host.strict_node import described
from host.test_melt import box_sidecar, moving_clip

from palette4d.hosts import SERVICE, kdenlive, parameters, shotcut

Described = dict[str, dict[str, Any]]

NAMESPACE = "{https://www.kdenlive.org}"

#: What hosts that tell a node nothing have no use for, and the handles' ids, which are texts.
LEFT_OUT = re.compile(
    r"version|clipFolder|clipFile|analyse|openInStudio|findByName|reload|embed|embedded|revision|status|resetHandles|handle\d\dId|"
    r"outputs|handles|handleIds|time"
)


@pytest.fixture(scope="module")
def node(strict_host: Path, bundle: Path) -> Described:
    return described(strict_host, bundle)


def effect() -> ET.Element:
    return ET.fromstring(kdenlive.effect_file("1.2.3").encode())


def rows() -> dict[str, ET.Element]:
    """Kdenlive's parameters by their names."""
    found = effect().findall(f"{NAMESPACE}parameter")
    by_name = {row.attrib["name"]: row for row in found}
    assert len(by_name) == len(found)
    return by_name


def label(row: ET.Element) -> str | None:
    return row.findtext(f"{NAMESPACE}name")


def default_option(described: dict[str, Any]) -> str:
    return str(described["options"][described["default"]])


def test_kdenlive_has_every_parameter_that_it_can_set(node: Described) -> None:
    assert set(rows()) == {name for name in node if not LEFT_OUT.fullmatch(name)}
    assert len(rows()) > 64


def test_kdenlive_has_the_nodes_labels(node: Described) -> None:
    assert {name: label(row) for name, row in rows().items()} == {
        name: node[name]["label"] for name in rows()
    }


def test_kdenlive_has_the_nodes_choices(node: Described) -> None:
    lists = {name: row for name, row in rows().items() if row.attrib["type"] == "list"}
    assert set(lists) == {name for name in rows() if node[name]["type"] == "OfxParamTypeChoice"}
    for name, row in lists.items():
        assert row.attrib["paramlist"].split(";") == node[name]["options"], name
        shown = row.findtext(f"{NAMESPACE}paramlistdisplay") or ""
        assert shown.split(",") == node[name]["options"], name
        assert row.attrib["default"] == default_option(node[name]), name


def test_kdenlive_has_the_nodes_numbers(node: Described) -> None:
    kinds = {"animated": 1, "constant": 0}
    numbers = {name: row for name, row in rows().items() if row.attrib["type"] in kinds}
    assert set(numbers) == {
        name
        for name in rows()
        if node[name]["type"] in ("OfxParamTypeDouble", "OfxParamTypeInteger")
    }
    for name, row in numbers.items():
        said = node[name]
        assert float(row.attrib["default"]) == said["default"], name
        assert kinds[row.attrib["type"]] == said["animates"], name
        low, high = float(row.attrib["min"]), float(row.attrib["max"])
        assert said["min"] <= low <= said["displayMin"], name
        assert said["displayMax"] <= high <= said["max"], name
        # The smallest value and the default can be set.
        decimals = int(row.attrib["decimals"])
        assert (round(low, decimals), round(said["default"], decimals)) == (low, said["default"])
        assert (decimals == 0) == (said["type"] == "OfxParamTypeInteger"), name


def test_kdenlive_has_the_nodes_switches_and_colours(node: Described) -> None:
    for kind, type_, default, said in (
        ("bool", "OfxParamTypeBoolean", "0", 0),
        ("color", "OfxParamTypeRGB", "0x808080ff", [0.5, 0.5, 0.501]),
    ):
        found = {name for name, row in rows().items() if row.attrib["type"] == kind}
        assert found == {name for name in rows() if node[name]["type"] == type_}
        assert len(found) >= parameters.HANDLES
        for name in found:
            assert rows()[name].attrib["default"] == default
            assert node[name]["default"] == said


def test_kdenlive_chooses_the_sidecar_as_a_file(node: Described) -> None:
    urls = [name for name, row in rows().items() if row.attrib["type"] == "url"]
    assert urls == ["sidecar"]
    assert node["sidecar"]["default"] == ""
    assert next(iter(rows())) == "sidecar"


def test_shotcut_has_the_nodes_parameters(node: Described) -> None:
    ui = shotcut.filter_files("1.2.3")["ui.qml"]
    labels = re.findall(r"Label \{ text: '([^']*)' \}", ui)
    # A row's control has the parameter's name as its id, and sets that one alone.
    names = [name for name in re.findall(r"^ +id: (\w+)$", ui, re.MULTILINE) if name != "dialog"]
    assert names == [parameter.name for parameter in parameters.MAIN]
    assert labels == [node[name]["label"] for name in names]
    assert set(re.findall(r"filter\.set\('(\w+)'", ui)) == set(names)
    for name in names:
        described = node[name]
        if options := described["options"]:
            model = ", ".join(f"'{option}'" for option in options)
            assert re.search(rf"id: {name}\n[^}}]*model: \[{model}\]", ui), name
            assert f"choose({name}, '{name}', '{default_option(described)}');" in ui
        elif described["type"] != "OfxParamTypeString":
            shown = set(re.findall(rf"number\('{name}', (\S+)\)", ui))
            assert shown == {f"{described['default']:g}"}, name


def test_shotcuts_sliders_are_shares(node: Described) -> None:
    ui = shotcut.filter_files("1.2.3")["ui.qml"]
    sliders = re.findall(r"SliderSpinner \{\n +id: (\w+)", ui)
    assert sliders == ["strength", "keepLightness", "cleanUp", "mix"]
    for name in sliders:
        assert (node[name]["min"], node[name]["max"]) == (0, 1)
    assert ui.count("maximumValue: 100") == len(sliders)


@pytest.fixture(scope="module")
def scene(melt: Path, bundle: Path, tmp_path_factory: pytest.TempPathFactory) -> Scene:
    folder = tmp_path_factory.mktemp("host_ui") / "clip"
    return Scene(melt, bundle.parent, folder, moving_clip(np.uint8, 4))


def stored(row: ET.Element) -> str:
    """What a project of Kdenlive has for a parameter that nobody touched, as it was seen to."""
    default = row.attrib.get("default", "")
    return f"00:00:00.000={default}" if row.attrib["type"] in ("animated", "color") else default


def test_the_files_name_the_nodes_service(scene: Scene) -> None:
    assert f"- {SERVICE}\n" in scene.run("-query", "filters").stdout
    assert effect().attrib["tag"] == effect().attrib["id"] == SERVICE
    assert f"mlt_service: '{SERVICE}'" in shotcut.filter_files("1.2.3")["meta.qml"]


def test_what_kdenlive_stores_at_first_is_the_nodes_defaults(scene: Scene) -> None:
    path = scene.folder / "box.p4d.json"
    sidecar = box_sidecar(path, scene.clip)
    at_first = {name: stored(row) for name, row in rows().items()} | {"sidecar": str(path)}
    frames, said = scene.render(**at_first)
    assert "persistent" not in said
    scene.check(frames, sidecar)
    # A handle that is switched on and left alone has the default's grey.
    used, _ = scene.render(**(at_first | {"handle15On": "1"}))
    grey, _ = scene.render(sidecar=path, handle15On=1, handle15="#808080")
    assert all(np.array_equal(a, b) for a, b in zip(used, grey, strict=True))
    assert not all(np.array_equal(a, b) for a, b in zip(used, frames, strict=True))


def test_every_option_of_kdenlives_lists_is_one_of_melts(scene: Scene) -> None:
    about = scene.run("-query", f"filter={SERVICE}").stdout
    for name, row in rows().items():
        if row.attrib["type"] == "list":
            said = about.partition(f"- identifier: {name}\n")[2].partition("- identifier")[0]
            values = re.findall(r"^ +- (.*)$", said.partition("values:")[2], re.MULTILINE)
            assert values == row.attrib["paramlist"].split(";"), name
