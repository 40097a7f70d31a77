#!/bin/sh
# The node on a machine with an NVIDIA GPU: its errors from double precision, its speed, and its tests
# in the strict host, by CUDA and OpenCL. It needs a driver and nothing else, and takes under four
# minutes.
#
#   tools/gpu_check.sh pack     on the machine that builds: collects all of it in build/gpu_check
#   tools/gpu_check.sh [OUT]    on the machine with the GPU, in a copy of this tree; the report also
#                               goes to the folder OUT
set -eu
root=$(cd "$(dirname "$0")/.." && pwd -P)
folder=$root/build/gpu_check

pack() {
    build=$root/build/cmake/test
    [ -f "$build/build.ninja" ] || {
        echo "gpu_check: found no C++ tests in $build; build them: make build-cpp" >&2
        exit 1
    }
    cmake --build "$build" --target palette4d_host_tests palette4d_node
    rm -rf "$folder"
    mkdir -p "$folder/lib" "$folder/vendors" "$folder/sidecars"
    cp -r "$build/node/Palette4D.ofx.bundle" "$folder/"
    cp "$build/tests/host/palette4d_host_tests" "$build"/tests/host/libpalette4d_opencl_faults.so "$folder/"
    strip "$folder/palette4d_host_tests"
    # Its libraries, for a machine whose own are older, and OpenCL's loader, which drivers lack.
    ldd "$folder/palette4d_host_tests" | awk '$3 ~ /^\// {print $3} $1 ~ /^\// {print $1}' |
        xargs -I{} cp -L {} "$folder/lib/"
    for loader in $(ldconfig -p | awk '/libOpenCL.so.1 .*x86-64/ {print $NF; exit}'); do
        cp -L "$loader" "$folder/lib/"
    done
    echo libnvidia-opencl.so.1 > "$folder/vendors/nvidia.icd"
    "${PYTHON:-$root/.venv/bin/python}" "$root/tests/parity/gpu_sidecars.py" "$folder/sidecars"
    du -sh "$folder"
}

run() {
    [ -f "$folder/palette4d_host_tests" ] || {
        echo "gpu_check: found no $folder; pack it where palette4d was built: tools/gpu_check.sh pack" >&2
        exit 1
    }
    # Copies may lose it.
    chmod +x "$folder/palette4d_host_tests" "$folder/lib/ld-linux-x86-64.so.2" 2>/dev/null || true
    out=${1:-$folder/report}
    mkdir -p "$out"
    export PALETTE4D_GPU_CHECK="$folder/sidecars" PALETTE4D_REQUIRE_GPU=1
    # The driver's OpenCL alone, where the machine names none.
    [ -d /etc/OpenCL/vendors ] || export OCL_ICD_VENDORS="$folder/vendors"
    test_program="$folder/palette4d_host_tests"
    start= usage=0
    "$test_program" >/dev/null 2>&1 || usage=$?
    if [ "$usage" -ne 2 ]; then
        start="$folder/lib/ld-linux-x86-64.so.2 --library-path $folder/lib:${LD_LIBRARY_PATH:-}:/usr/lib/x86_64-linux-gnu:/usr/lib64"
    fi
    ldconfig -p 2>/dev/null | grep -q 'libOpenCL.so.1' || {
        mkdir -p "$folder/opencl"
        cp "$folder"/lib/libOpenCL.so.1* "$folder/opencl/" 2>/dev/null || true
        export LD_LIBRARY_PATH="$folder/opencl${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
    }
    {
        nvidia-smi --query-gpu=name,driver_version --format=csv,noheader 2>&1 || true
        status=0
        for part in gpu_check_errors gpu_check_clean_up gpu_check_speed "gpu_ -gpu_check"; do
            # shellcheck disable=SC2086
            timeout 180 $start "$test_program" "$folder/Palette4D.ofx.bundle" "$folder/work" $part 2>&1 ||
                status=$?
        done
        echo "gpu_check: status $status"
    } | tee "$out/gpu_check.txt"
    grep -q 'gpu_check: status 0' "$out/gpu_check.txt"
}

if [ "${1:-}" = pack ]; then
    pack
else
    run "$@"
fi
