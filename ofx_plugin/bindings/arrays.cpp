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

void require_columns(const py::array& array, const char* what, const char* rows,
                     std::size_t columns) {
    if (array.ndim() != 2 || array.shape(1) != static_cast<py::ssize_t>(columns)) {
        throw py::value_error(std::string(what) + ": found shape " + shape_text(array) +
                              ", expected (" + rows + ", " + std::to_string(columns) + ")");
    }
}

[[noreturn]] void wrong_type(const py::array& array, const char* what, const char* expected) {
    throw py::value_error(std::string(what) + ": found dtype " +
                          std::string(py::str(array.dtype())) + ", expected " + expected);
}

py::array_t<double, py::array::c_style | py::array::forcecast> doubles_of(const py::array& array,
                                                                          const char* what) {
    const char kind = array.dtype().kind();
    if (kind != 'f' && kind != 'i' && kind != 'u') wrong_type(array, what, "real numbers");
    return array;
}

template <std::size_t N>
std::vector<std::array<double, N>> rows_from(const py::object& object, const char* what) {
    const py::array array = array_from(object, what);
    require_columns(array, what, "n", N);
    const auto doubles = doubles_of(array, what);
    std::vector<std::array<double, N>> rows(static_cast<std::size_t>(array.shape(0)));
    if (!rows.empty()) std::memcpy(rows.data(), doubles.data(), rows.size() * sizeof(rows[0]));
    return rows;
}

template <std::size_t N>
DoubleArray rows_to_array(const std::vector<std::array<double, N>>& rows) {
    DoubleArray array({static_cast<py::ssize_t>(rows.size()), static_cast<py::ssize_t>(N)});
    if (!rows.empty())
        std::memcpy(array.mutable_data(), rows.data(), rows.size() * sizeof(rows[0]));
    return array;
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
    return rows_from<3>(object, what);
}

std::vector<std::array<double, 4>> vertices_from(const py::object& object, const char* what) {
    return rows_from<4>(object, what);
}

std::vector<double> numbers_from(const py::object& object, const char* what) {
    const py::array array = array_from(object, what);
    if (array.ndim() != 1) {
        throw py::value_error(std::string(what) + ": found shape " + shape_text(array) +
                              ", expected (n,)");
    }
    const auto doubles = doubles_of(array, what);
    return std::vector<double>(doubles.data(), doubles.data() + doubles.size());
}

std::vector<Face> faces_from(const py::object& object) {
    const py::array array = array_from(object, "faces");
    if (array.size() == 0) return {};
    require_columns(array, "faces", "f", 3);
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

DoubleArray to_array(const std::vector<double>& numbers) {
    return DoubleArray(static_cast<py::ssize_t>(numbers.size()), numbers.data());
}

DoubleArray to_array(const std::vector<Vec3>& colours) { return rows_to_array(colours); }

DoubleArray to_array(const std::vector<std::array<double, 4>>& vertices) {
    return rows_to_array(vertices);
}

IntArray to_array(const std::vector<Face>& faces) {
    IntArray array({static_cast<py::ssize_t>(faces.size()), py::ssize_t{3}});
    if (!faces.empty()) {
        std::memcpy(array.mutable_data(), faces.data(), faces.size() * sizeof(Face));
    }
    return array;
}

void require_image(const py::array& image, const char* what) {
    const std::string name(what);
    if (!py::isinstance<py::array_t<float>>(image)) {
        throw py::value_error(name + ": found dtype " + std::string(py::str(image.dtype())) +
                              ", expected float32");
    }
    if (image.ndim() != 3 || (image.shape(2) != 3 && image.shape(2) != 4)) {
        throw py::value_error(name + ": found shape " + shape_text(image) +
                              ", expected (h, w, 3) or (h, w, 4)");
    }
    if (image.shape(0) > std::numeric_limits<int>::max() ||
        image.shape(1) > std::numeric_limits<int>::max()) {
        throw py::value_error(name + ": found shape " + shape_text(image) +
                              ", expected less than 2^31 rows and columns");
    }
    if (image.size() == 0) return;
    const py::ssize_t channel = sizeof(float), pixel = channel * image.shape(2);
    if (image.strides(2) != channel || (image.shape(1) > 1 && image.strides(1) != pixel)) {
        throw py::value_error(name + ": found strides of " + std::to_string(image.strides(1)) +
                              " bytes per pixel and " + std::to_string(image.strides(2)) +
                              " per channel, expected packed rows (" + std::to_string(pixel) +
                              " and " + std::to_string(channel) + "); use numpy.ascontiguousarray");
    }
    if (image.shape(0) > 1 && std::abs(image.strides(0)) < pixel * image.shape(1)) {
        throw py::value_error(name + ": found rows " + std::to_string(image.strides(0)) +
                              " bytes apart, expected rows that do not overlap");
    }
    if (image.strides(0) % channel != 0 ||
        reinterpret_cast<std::uintptr_t>(image.data()) % alignof(float) != 0) {
        throw py::value_error(name + ": found unaligned memory, expected aligned float32");
    }
}

}  // namespace palette4d::bindings
