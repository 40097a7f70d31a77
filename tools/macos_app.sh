#!/bin/sh
# Makes APP, "Palette4D Studio.app": a wheel for macOS and what it needs, for the Python of python.org.
# Usage: macos_app.sh APP WHEEL, with pip in python3 (make macos-zip).
set -eu
app=$1 wheel=$2
[ -f "$wheel" ] || {
    echo "$wheel: found no wheel for macOS and Python 3.13; make wheels builds it, with python3.13 on PATH" >&2
    exit 1
}
version=$(basename "$wheel" | cut -d- -f2)
# An environment of that Python, which finds its packages by pyvenv.cfg, wherever the app lies.
home=/Library/Frameworks/Python.framework/Versions/3.13/bin
python=$app/Contents/Resources/python
rm -rf "$app"
mkdir -p "$python/bin" "$app/Contents/MacOS"
printf 'home = %s\ninclude-system-site-packages = false\nversion = 3.13\n' $home >"$python/pyvenv.cfg"
ln -s $home/python3.13 "$python/bin/python3.13"
install() {
    # pip asks what the Python that runs it is; the hashes say that these are right.
    python3 -m pip --quiet --disable-pip-version-check install --no-deps --no-compile \
        --ignore-requires-python --target "$python/lib/python3.13/site-packages" \
        --python-version 3.13 --platform macosx_14_0_arm64 --only-binary :all: "$@"
}
install --require-hashes -r locks/macos.txt
install --no-index "$wheel"
cp tools/macos/studio.sh "$app/Contents/MacOS/Palette4D Studio"
cp tools/macos/palette4d.sh "$app/Contents/MacOS/palette4d"
chmod +x "$app/Contents/MacOS"/*
sed "s/@VERSION@/$version/" tools/macos/Info.plist >"$app/Contents/Info.plist"
