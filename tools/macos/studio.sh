#!/bin/sh
# The window; the Finder starts this. Python is that of python.org, which the app does not hold.
python=$(cd "$(dirname "$0")/../Resources/python/bin" && pwd -P)/python3.13
if ! [ -x "$python" ]; then
    osascript -e 'display alert "Palette4D Studio needs Python 3.13" message "Install Python 3.13 from python.org, then open Palette4D Studio again."'
    exit 1
fi
exec "$python" -I -m palette4d studio "$@"
