#!/bin/sh
# Makes a Windows for the tests: Wine, the folder of a .zip in a path with blanks and of no code page, and
# the tests' tools. Usage: wine.sh FOLDER ZIP (make test-windows).
set -eu
folder=$1 zip=$2
command -v wine >/dev/null || {
    echo "wine is missing; install Debian's packages wine and wine64" >&2
    exit 1
}
unpacked="$folder/Grüße 色"
rm -rf "$unpacked" "$folder/tools"
mkdir -p "$unpacked"
python3 -m zipfile -e "$zip" "$unpacked"
python3 -m pip --quiet --disable-pip-version-check install --no-deps --require-hashes --no-compile \
    --target "$folder/tools" --python-version 3.13 --platform win_amd64 --only-binary :all: \
    -r locks/windows-test.txt
if ! [ -d "$folder/wine" ]; then
    WINEPREFIX=$folder/wine WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=" sh -c \
        'wineboot --init && wine winecfg -v win10 && wineserver --wait' </dev/null >/dev/null 2>&1
    # Desktop and Documents would be those of the user here.
    find "$folder/wine/drive_c/users" -type l -exec sh -c 'rm "$1" && mkdir "$1"' - {} \;
    # Wine has no font of its own.
    fonts="$unpacked/palette4d/python/Lib/site-packages/matplotlib/mpl-data/fonts/ttf"
    cp "$fonts"/DejaVuSans*.ttf "$folder/wine/drive_c/windows/Fonts"
fi
