"""The pictures that the parts and channels of an image file hold, and the choice of one."""

from __future__ import annotations

from typing import Any

from palette4d.media import oiio_text
from palette4d.media.reading import Reading

#: Names of red, green and blue.
COLOURS = (("R", "G", "B"), ("r", "g", "b"), ("red", "green", "blue"))
_ALPHAS = ("A", "a", "alpha")


def channels_of(spec: Any, asked: Reading) -> list[int] | None:
    """Return the channels of the layer and the view that are asked for; None: not in this part."""
    for layer, view, channels in pictures(spec):
        fits = asked.layer is None or asked.layer in (layer, layer or part_name(spec))
        if fits and asked.view in (None, view) and (asked.layer is not None or not layer):
            return channels
    return None


def pictures(spec: Any) -> list[tuple[str, str, list[int]]]:
    """Return the layer, the view and the channels of each picture of a part.

    A name is LAYER.VIEW.R, in which both may be missing. The names of views are those of the
    attribute `multiView`; a channel without one belongs to the first of them, or to the part's.
    """
    names = [oiio_text.readable(name) for name in spec.channelnames]
    views = [str(view) for view in spec.getattribute("multiView") or ()]
    own = oiio_text.readable(spec.get_string_attribute("view")) or (views[0] if views else "")
    layers = []
    for prefix in dict.fromkeys(name.rpartition(".")[0] for name in names):
        dot = f"{prefix}." if prefix else ""
        for colours in COLOURS:
            channels = [names.index(dot + channel) for channel in colours if dot + channel in names]
            if len(channels) == 3:
                alpha = [
                    names.index(dot + channel) for channel in _ALPHAS if dot + channel in names
                ]
                words = prefix.split(".") if prefix else []
                view = next((word for word in words if word in views), own)
                layer = ".".join(word for word in words if word not in views)
                layers.append((layer, view, channels + alpha[:1]))
    return layers


def part_name(spec: Any) -> str:
    """Return the name of a part, which is a layer's, too."""
    return str(oiio_text.readable(spec.get_string_attribute("oiio:subimagename")))


def described(specs: list[Any]) -> str:
    """Return the layers and views of a file for an error."""
    names: list[str] = []
    for spec in specs:
        for layer, view, _ in pictures(spec):
            name = layer or part_name(spec) or "the main layer"
            names.append(f"{name} (view {view})" if view else name)
    return ", ".join(dict.fromkeys(names)) or "no layers"
