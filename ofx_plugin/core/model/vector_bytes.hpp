#pragma once

#include <cstddef>
#include <vector>

namespace palette4d {

/// The memory that vectors' elements take.
template <class... T>
std::size_t vector_bytes(const std::vector<T>&... vectors) {
    return (std::size_t{0} + ... + (vectors.size() * sizeof(T)));
}

}  // namespace palette4d
