#include "arrays.hpp"

#include <cstring>
#include <limits>

namespace palette4d::bindings {
namespace {

py::array array_from(const py::object& object, const char* what) {
    const py::array array = py::array::ensure(object);
    if (!array) {
        PyErr_Clear();
        throw py::value_error(std::string(what) + ": not an array of numbers");
    }
    return array;
}

void require_three_columns(const py::array& array, const char* what, const char* rows) {
    if (array.ndim() != 2 || array.shape(1) != 3) {
        throw py::value_error(std::string(what) + ": found shape " + shape_text(array) +
                              ", expected (" + rows + ", 3)");
    }
}

[[noreturn]] void wrong_type(const py::array& array, const char* what, const char* expected) {
    throw py::value_error(std::string(what) + ": found dtype " +
                          std::string(py::str(array.dtype())) + ", expected " + expected);
}

}  // namespace

std::string shape_text(const py::array& array) {
    std::string text = "(";
    for (py::ssize_t i = 0; i < array.ndim(); ++i) {
        text += (i ? ", " : "") + std::to_string(array.shape(i));
    }
    return text + (array.ndim() == 1 ? ",)" : ")");
}

std::vector<Vec3> colours_from(const py::object& object, const char* what) {
    const py::array array = array_from(object, what);
    require_three_columns(array, what, "n");
    const char kind = array.dtype().kind();
    if (kind != 'f' && kind != 'i' && kind != 'u') wrong_type(array, what, "real numbers");
    const auto doubles = py::array_t<double, py::array::c_style | py::array::forcecast>(array);
    std::vector<Vec3> colours(static_cast<std::size_t>(array.shape(0)));
    if (!colours.empty()) {
        std::memcpy(colours.data(), doubles.data(), colours.size() * sizeof(Vec3));
    }
    return colours;
}

std::vector<Face> faces_from(const py::object& object) {
    const py::array array = array_from(object, "faces");
    if (array.size() == 0) return {};
    require_three_columns(array, "faces", "f");
    const char kind = array.dtype().kind();
    if (kind != 'i' && kind != 'u') wrong_type(array, "faces", "integers");
    const auto wide = py::array_t<long long, py::array::c_style | py::array::forcecast>(array);
    std::vector<Face> faces(static_cast<std::size_t>(array.shape(0)));
    for (std::size_t f = 0; f < faces.size(); ++f) {
        for (std::size_t k = 0; k < 3; ++k) {
            const long long corner = wide.data()[3 * f + k];
            if (corner < 0 || corner > std::numeric_limits<int>::max()) {
                throw py::value_error("faces: found corner " + std::to_string(corner) +
                                      ", expected the index of a colour");
            }
            faces[f][k] = static_cast<int>(corner);
        }
    }
    return faces;
}

DoubleArray to_array(const std::vector<Vec3>& colours) {
    DoubleArray array({static_cast<py::ssize_t>(colours.size()), py::ssize_t{3}});
    if (!colours.empty()) {
        std::memcpy(array.mutable_data(), colours.data(), colours.size() * sizeof(Vec3));
    }
    return array;
}

IntArray to_array(const std::vector<Face>& faces) {
    IntArray array({static_cast<py::ssize_t>(faces.size()), py::ssize_t{3}});
    if (!faces.empty()) {
        std::memcpy(array.mutable_data(), faces.data(), faces.size() * sizeof(Face));
    }
    return array;
}

}  // namespace palette4d::bindings
