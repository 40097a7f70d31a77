# Release builds for every system with one compiler, `zig c++` (PyPI: ziglang). PALETTE4D_ZIG is the
# program zig, and PALETTE4D_ZIG_TARGET the system: x86_64-linux-gnu.2.17, aarch64-macos.11.0, ….
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES PALETTE4D_ZIG PALETTE4D_ZIG_TARGET)
if(NOT EXISTS "${PALETTE4D_ZIG}")
  message(FATAL_ERROR "PALETTE4D_ZIG: found '${PALETTE4D_ZIG}', expected the program zig")
endif()
if(NOT PALETTE4D_ZIG_TARGET MATCHES "^([a-z0-9_]+)-(linux|windows|macos)")
  message(FATAL_ERROR "PALETTE4D_ZIG_TARGET: found '${PALETTE4D_ZIG_TARGET}', expected a target of "
                      "zig's for linux, windows or macos")
endif()
set(CMAKE_SYSTEM_PROCESSOR ${CMAKE_MATCH_1})
if(CMAKE_MATCH_2 STREQUAL "windows")
  set(CMAKE_SYSTEM_NAME Windows)
elseif(CMAKE_MATCH_2 STREQUAL "macos")
  set(CMAKE_SYSTEM_NAME Darwin)
  # zig brings the headers, and its target names the oldest version.
  set(CMAKE_OSX_SYSROOT "" CACHE STRING "")
  set(CMAKE_OSX_DEPLOYMENT_TARGET "" CACHE STRING "")
  # CMake asks for it, and changes no library with it here.
  set(CMAKE_INSTALL_NAME_TOOL "${PALETTE4D_ZIG}")
else()
  set(CMAKE_SYSTEM_NAME Linux)
  set(_hardened "-Wl,-z,relro,-z,now -Wl,-z,noexecstack")
endif()

set(CMAKE_CXX_COMPILER "${PALETTE4D_ZIG}" c++)
set(CMAKE_CXX_COMPILER_TARGET "${PALETTE4D_ZIG_TARGET}")
# The linker strips what it writes (-s below).
set(CMAKE_STRIP "" CACHE STRING "")
# zig has a cache of its own.
set(CMAKE_CXX_COMPILER_LAUNCHER "" CACHE STRING "")
set(CMAKE_CXX_ARCHIVE_CREATE "\"${PALETTE4D_ZIG}\" ar qcD <TARGET> <LINK_FLAGS> <OBJECTS>")
set(CMAKE_CXX_ARCHIVE_APPEND "\"${PALETTE4D_ZIG}\" ar qD <TARGET> <LINK_FLAGS> <OBJECTS>")
set(CMAKE_CXX_ARCHIVE_FINISH "\"${PALETTE4D_ZIG}\" ranlib -D <TARGET>")
# What is checked is what compiles; linking would build zig's run-time once more, without -O3.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

# No path of this machine in what is built: the same bytes in any folder.
cmake_path(GET CMAKE_CURRENT_LIST_DIR PARENT_PATH _root)
cmake_path(GET _root PARENT_PATH _root)
set(CMAKE_CXX_FLAGS_INIT "-fstack-protector-strong \"-ffile-prefix-map=${_root}=.\"")
foreach(_kind IN ITEMS EXE MODULE SHARED)
  set(CMAKE_${_kind}_LINKER_FLAGS_INIT "${_hardened} -s")
endforeach()
