#!/bin/sh
# Prints the path of a Python that can build and run palette4d: 3.11 to 3.13, with the venv module and
# the C headers. Looks at every candidate on PATH, not only the first (a version manager's shim may
# exist and yet lead nowhere). Usage: find_python.sh [COMMAND]; with COMMAND only that one is tried.
set -eu

check='
import sys, sysconfig, pathlib
if not (3, 11) <= sys.version_info[:2] < (3, 14):
    sys.exit("is Python %d.%d" % sys.version_info[:2])
try:
    import venv, ensurepip
except ImportError as error:
    sys.exit("has no %s module (Debian and Ubuntu: package python3-venv)" % error.name)
include = sysconfig.get_path("include")
if not pathlib.Path(include, "Python.h").is_file():
    sys.exit("has no Python.h in %s (Debian and Ubuntu: package python3-dev)" % include)
print(sys.executable)
'
tried=
newline='
'

try() {
    if found=$("$1" -c "$check" 2>&1) && [ -n "$found" ]; then
        printf '%s\n' "$found"
        exit 0
    fi
    tried="$tried
  $1: ${found%%"$newline"*}"
}

if [ $# -gt 0 ] && [ -n "$1" ]; then
    try "$1"
else
    for name in python3 python3.13 python3.12 python3.11 python; do
        rest=$PATH:
        while [ -n "$rest" ]; do
            folder=${rest%%:*}
            rest=${rest#*:}
            if [ -x "$folder/$name" ]; then try "$folder/$name"; fi
        done
    done
fi

echo "palette4d needs Python 3.11, 3.12 or 3.13, with venv and C headers; none was found. Tried:${tried:-
  (no python on PATH)}
Install one, or name it: make PYTHON=/path/to/python3.12 …" >&2
exit 1
