// Loads a system's library at run time.
#pragma once

#include <initializer_list>
#include <string>

namespace palette4d::gpu {

/// The first library that can be loaded, for the life of the process; null for none. One that the
/// host has loaded comes first.
void* load_library(std::initializer_list<const char*> names);
/// Its function; null where it has none.
void* function_of(void* library, const char* name);
template <class Function>
bool find_function(void* library, const char* name, Function& to) {
    to = reinterpret_cast<Function>(function_of(library, name));
    return to != nullptr;
}

/// What *Status* says of a driver's error.
inline std::string driver_error(const char* function, int error) {
    return std::string(function) + " failed with error " + std::to_string(error);
}

}  // namespace palette4d::gpu
