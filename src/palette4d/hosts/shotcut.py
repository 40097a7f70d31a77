"""Shotcut's filter folder: the main parameters, with a button to choose the sidecar.

Shotcut (26.9) lists all parameters itself, but only with `--experimental` and without such a
button. Its filters are QML files. These files use the controls of that version's own filters.
Keyframes from other programs stay until the user moves the slider.
"""

from palette4d.hosts import SERVICE, origin
from palette4d.hosts.parameters import MAIN, Choice, File, Number, Parameter

#: Below the folder of Shotcut's data.
FOLDER = "palette4d"

_META = """\
// @ORIGIN@
import QtQuick
import org.shotcut.qml

Metadata {
    type: Metadata.Filter
    name: 'Palette4D'
    objectName: 'palette4d'
    mlt_service: '@SERVICE@'
    keywords: 'palette4d palette recolour color sidecar'
    qml: 'ui.qml'
}
"""

_UI = """\
// @ORIGIN@
import QtQuick
import QtQuick.Controls
import QtQuick.Layouts
import Shotcut.Controls as Shotcut

Item {
    // False while the rows are filled: these changes are not the user's edits.
    property bool ready: false

    // A missing value or an unknown option gets the node's default.
    function choose(box, name, initial) {
        var index = box.model.indexOf(filter.get(name));
        box.currentIndex = index < 0 ? box.model.indexOf(initial) : index;
    }

    function number(name, initial) {
        return filter.get(name) === '' ? initial : filter.getDouble(name);
    }

    // With a second slash in front, a project does not shorten paths below its own folder.
    function take(path) {
        filter.set('sidecar', path.replace(/^\\/+/, '//'));
    }

    width: 350
    height: @HEIGHT@
    Component.onCompleted: {
@FILL@
        ready = true;
    }

    Shotcut.FileDialog {
        id: dialog
        nameFilters: ['Palette4D sidecars (*.json)']
        onAccepted: {
            sidecar.text = dialog.selectedFile;
            take(sidecar.text);
        }
    }

    GridLayout {
        columns: 3
        anchors.fill: parent
        anchors.margins: 8
@ROWS@
        Item {
            Layout.fillHeight: true
        }
    }
}
"""

_FILE_ROW = """\
        TextField {
            id: @NAME@
            Layout.fillWidth: true
            selectByMouse: true
            onEditingFinished: take(text)
        }
        Button {
            text: '...'
            onClicked: dialog.open()
        }"""

_CHOICE_ROW = """\
        ComboBox {
            id: @NAME@
            Layout.columnSpan: 2
            Layout.fillWidth: true
            model: [@OPTIONS@]
            onActivated: filter.set('@NAME@', currentText)
        }"""

# Values from 0 to 1, shown in per cent.
_SHARE_ROW = """\
        Shotcut.SliderSpinner {
            id: @NAME@
            Layout.columnSpan: 2
            minimumValue: @LOW@
            maximumValue: @HIGH@
            suffix: ' %'
            onValueChanged: if (ready) filter.set('@NAME@', value / 100)
        }"""

# Text that is no number within the range is reset.
_NUMBER_ROW = """\
        TextField {
            id: @NAME@
            Layout.columnSpan: 2
            selectByMouse: true
            onEditingFinished: {
                if (text !== '' && Number(text) >= @LOW@ && Number(text) <= @HIGH@)
                    filter.set('@NAME@', Number(text));
                text = number('@NAME@', @INITIAL@);
            }
        }"""


def filter_files(version: str) -> dict[str, str]:
    """Return the texts of the folder's files by name, in the order in which to write them.

    The last file makes Shotcut load the folder.
    """
    by = origin(version)
    rows = "\n".join(
        f"        Label {{ text: '{parameter.label}' }}\n{_control(parameter)}"
        for parameter in MAIN
    )
    ui = _put(
        _UI,
        ORIGIN=by,
        HEIGHT=str(36 * len(MAIN)),
        FILL="\n".join(f"        {_fill(parameter)};" for parameter in MAIN),
        ROWS=rows,
    )
    return {"ui.qml": ui, "meta.qml": _put(_META, ORIGIN=by, SERVICE=SERVICE)}


def _control(parameter: Parameter) -> str:
    match parameter:
        case File():
            return _put(_FILE_ROW, NAME=parameter.name)
        case Choice():
            return _put(_CHOICE_ROW, NAME=parameter.name, OPTIONS=_words(parameter.options))
        case Number() if _is_share(parameter):
            return _put(_SHARE_ROW, NAME=parameter.name, LOW="0", HIGH="100")
        case Number():
            return _put(
                _NUMBER_ROW,
                NAME=parameter.name,
                LOW=f"{parameter.low:g}",
                HIGH=f"{parameter.high:g}",
                INITIAL=f"{parameter.initial:g}",
            )
    raise TypeError(f"no row for {parameter}")


def _fill(parameter: Parameter) -> str:
    """Return the statement that shows the project's value."""
    name = parameter.name
    match parameter:
        case File():
            return f"{name}.text = filter.get('{name}').replace(/^\\/+/, '/')"
        case Choice():
            return f"choose({name}, '{name}', '{parameter.initial}')"
        case Number() if _is_share(parameter):
            return f"{name}.value = number('{name}', {parameter.initial:g}) * 100"
        case Number():
            return f"{name}.text = number('{name}', {parameter.initial:g})"
    raise TypeError(f"no row for {parameter}")


def _is_share(parameter: Number) -> bool:
    return (parameter.low, parameter.high) == (0, 1)


def _words(options: tuple[str, ...]) -> str:
    return ", ".join(f"'{option}'" for option in options)


def _put(template: str, **texts: str) -> str:
    """Replace a template's @NAMES@ by texts."""
    for name, text in texts.items():
        template = template.replace(f"@{name}@", text)
    return template
