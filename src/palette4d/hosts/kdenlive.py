"""Kdenlive's effect file: rows for parameters that Kdenlive's own list omits or gets wrong.

Kdenlive (26.08) lists an OpenFX effect's parameters itself, but without texts, so without the
sidecar. It stores choices as numbers, which MLT rejects. An effect file replaces that list if its
id is the service's name.
"""

from xml.etree import ElementTree

from palette4d.hosts import SERVICE, origin
from palette4d.hosts.parameters import ALL, Choice, Colour, File, Number, Parameter, Switch

#: Below the folder of Kdenlive's data.
FILE = "palette4d.xml"

_DESCRIPTION = """\
Recolours a clip by the edits made to its time-varying colour palette. Choose the sidecar that \
'palette4d analyze' made of this clip."""


def effect_file(version: str) -> str:
    """Return the effect file's text, an XML document that names this version of palette4d."""
    effect = ElementTree.Element(
        "effect",
        {"xmlns": "https://www.kdenlive.org", "tag": SERVICE, "id": SERVICE, "type": "video"},
    )
    for name, text in (
        ("name", "Palette4D"),
        ("description", _DESCRIPTION),
        ("author", "palette4d"),
    ):
        ElementTree.SubElement(effect, name).text = text
    for parameter in ALL:
        effect.append(_row(parameter))
    ElementTree.indent(effect)
    head = f'<?xml version="1.0" encoding="UTF-8"?>\n<!-- {origin(version)} -->\n'
    return head + ElementTree.tostring(effect, encoding="unicode") + "\n"


def _row(parameter: Parameter) -> ElementTree.Element:
    row = ElementTree.Element("parameter", name=parameter.name)
    match parameter:
        case File():
            row.attrib |= {"type": "url", "filter": "Palette4D sidecars (*.json)"}
        case Choice():
            # The first list holds the stored values, the second the displayed names.
            row.attrib |= {"type": "list", "default": parameter.initial}
            row.attrib["paramlist"] = ";".join(parameter.options)
            ElementTree.SubElement(row, "paramlistdisplay").text = ",".join(parameter.options)
        case Number():
            row.attrib |= {
                "type": "animated" if parameter.animates else "constant",
                "default": f"{parameter.initial:g}",
                "min": f"{parameter.low:g}",
                "max": f"{parameter.high:g}",
                "decimals": str(parameter.decimals),
            }
        case Switch():
            row.attrib |= {"type": "bool", "default": "0"}
        case Colour():
            # MLT and Kdenlive agree on 0xRRGGBBAA, but not on '#' with eight digits.
            row.attrib |= {"type": "color", "default": "0x808080ff"}
    ElementTree.SubElement(row, "name").text = parameter.label
    return row
