#!/bin/sh
# Builds, checks and tries a wheel for each of Python 3.11 to 3.13 that is found on PATH.
# Usage: wheels.sh FOLDER BUNDLE, with the release's environment on PATH and PALETTE4D_ZIG set (make wheels).
# FOLDER/wheels gets the wheels. What is missing or fails ends the run, but for a Python: one is enough.
set -eu

folder=$1 bundle=$2
pip="-m pip --quiet --disable-pip-version-check"
wheels=$folder/wheels
rm -rf "$wheels"
mkdir -p "$wheels"
found=
for version in 3.11 3.12 3.13; do
    if ! python=$(tools/find_python.sh "python$version" 2>/dev/null); then
        echo "== no wheel for Python $version: no python$version with venv and C headers on PATH"
        continue
    fi
    echo "== a wheel for Python $version, with $python"
    env=$folder/python$version
    rm -rf "$env" "$folder/raw$version"
    "$python" -m venv "$env"
    "$env/bin/python" $pip install --require-hashes --only-binary :all: -r locks/build.txt
    "$env/bin/python" $pip wheel . --no-deps --no-build-isolation --wheel-dir "$folder/raw$version" \
        --config-settings=build-dir="build/cmake/wheel$version" \
        --config-settings=cmake.define.CMAKE_TOOLCHAIN_FILE="$PWD/ofx_plugin/cmake/ZigToolchain.cmake" \
        --config-settings=cmake.define.PALETTE4D_ZIG="$PALETTE4D_ZIG" \
        --config-settings=cmake.define.PALETTE4D_ZIG_TARGET=x86_64-linux-gnu.2.17 \
        --config-settings=cmake.define.CMAKE_INTERPROCEDURAL_OPTIMIZATION=OFF \
        --config-settings=cmake.define.PALETTE4D_WERROR=ON \
        --config-settings=cmake.define.PALETTE4D_BUILD_PLUGIN=OFF \
        --config-settings=cmake.define.PALETTE4D_READY_BUNDLE="$bundle"
    # What the wheel depends on needs glibc 2.28.
    auditwheel repair --only-plat --plat manylinux_2_28_x86_64 --wheel-dir "$wheels" "$folder/raw$version"/*.whl

    tag=cp$(echo "$version" | tr -d .)
    wheel=$(echo "$wheels"/palette4d-*-"$tag-$tag"-*.whl)
    auditwheel show "$wheel"
    echo "== $wheel in a bare environment: the demo, and the bundle"
    rm -rf "$env"
    "$python" -m venv "$env"
    "$env/bin/python" $pip install --only-binary :all: "$wheel"
    CXX=/nonexistent CC=/nonexistent "$env/bin/python" tools/demo.py "$folder/demo$version"
    "$env/bin/palette4d" install-plugin --dest "$folder/OFX$version" --force
    (cd "$bundle" && find . -type f -exec sha256sum {} +) >"$env/expected"
    (cd "$folder/OFX$version/Palette4D.ofx.bundle" && sha256sum --quiet -c -) <"$env/expected"
    found="$found $version"
done
[ -n "$found" ] || { echo "no Python 3.11 to 3.13 was found on PATH" >&2; exit 1; }
(cd "$wheels" && sha256sum -- *.whl >SHA256SUMS-wheels)
echo "== wheels for Python$found: built, checked, and run through the demo"
cat "$wheels/SHA256SUMS-wheels"
