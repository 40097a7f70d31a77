#!/bin/sh
# Makes FOLDER/python: a copy of PYTHON (3.13) with a wheel and what it needs, and two start scripts.
# Usage: linux_python.sh FOLDER WHEEL PYTHON, with patchelf and strip on PATH (make linux-tar).
set -eu
folder=$1 wheel=$2 python=$3
base=$("$python" -c 'import sys; print(sys.base_prefix)')
rm -rf "$folder"
mkdir -p "$folder/python/bin" "$folder/python/lib"
cp "$base/bin/python3.13" "$folder/python/bin"
if [ -e "$base/lib/libpython3.13.so.1.0" ]; then
    strip -o "$folder/python/lib/libpython3.13.so.1.0" "$base/lib/libpython3.13.so.1.0"
fi
tar -c -C "$base/lib" --exclude=site-packages --exclude=__pycache__ --exclude=test --exclude=idlelib \
    --exclude=tkinter --exclude=ensurepip --exclude='config-*' --exclude='_test*' python3.13 |
    tar -x -C "$folder/python/lib"
patchelf --set-rpath '$ORIGIN/../lib' "$folder/python/bin/python3.13"
"$python" -m pip --quiet --disable-pip-version-check install --no-deps --no-compile --require-hashes \
    --only-binary :all: --target "$folder/python/lib/python3.13/site-packages" -r locks/linux.txt
"$python" -m pip --quiet --disable-pip-version-check install --no-deps --no-compile --no-index \
    --target "$folder/python/lib/python3.13/site-packages" "$wheel"
for name in palette4d palette4d-studio; do
    verb=${name#palette4d}
    printf '#!/bin/sh\nexec "$(dirname "$(readlink -f "$0")")/python/bin/python3.13" -I -m palette4d %s"$@"\n' \
        "${verb:+${verb#-} }" >"$folder/$name"
    chmod +x "$folder/$name"
done
