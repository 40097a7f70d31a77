#!/bin/sh
# The command line.
exec "$(cd "$(dirname "$0")/../Resources/python/bin" && pwd -P)/python3.13" -I -m palette4d "$@"
