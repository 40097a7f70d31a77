# Finds nlohmann-json's headers: a CMake package where the system has one, else the header-only
# PyPI distribution `nlohmann-json`, asked through the Python that drives the build.
find_package(nlohmann_json CONFIG QUIET)
if(NOT nlohmann_json_FOUND)
  if(NOT Python_EXECUTABLE)
    find_package(Python 3.11 COMPONENTS Interpreter REQUIRED)
  endif()
  execute_process(
    COMMAND "${Python_EXECUTABLE}" -c
            "import importlib.metadata as m; f = next(p for p in m.files('nlohmann-json') if str(p).replace('\\\\', '/').endswith('include/nlohmann/json.hpp')); print(f.locate().resolve().parent.parent.as_posix())"
    OUTPUT_VARIABLE _nlohmann_include
    OUTPUT_STRIP_TRAILING_WHITESPACE
    ERROR_QUIET)
  find_path(nlohmann_json_INCLUDE_DIR nlohmann/json.hpp HINTS "${_nlohmann_include}")
  include(FindPackageHandleStandardArgs)
  find_package_handle_standard_args(nlohmann_json REQUIRED_VARS nlohmann_json_INCLUDE_DIR)
  if(nlohmann_json_FOUND AND NOT TARGET nlohmann_json::nlohmann_json)
    add_library(nlohmann_json::nlohmann_json INTERFACE IMPORTED)
    set_target_properties(nlohmann_json::nlohmann_json PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES "${nlohmann_json_INCLUDE_DIR}")
  endif()
endif()
