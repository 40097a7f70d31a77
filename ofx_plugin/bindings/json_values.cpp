#include "json_values.hpp"

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "model/sidecar_error.hpp"

namespace palette4d::bindings {
namespace {

class Reader {
public:
    explicit Reader(const std::string& file) : file_(file) {}

    Json read(const py::handle& value) {
        if (++values_ > kMaxValues) {
            fail("more than " + std::to_string(kMaxValues) + " values", "fewer");
        }
        PyObject* const object = value.ptr();
        if (value.is_none()) return nullptr;
        if (PyBool_Check(object)) return object == Py_True;
        if (PyUnicode_Check(object)) return text(object);
        if (PyLong_Check(object)) return integer(object);
        if (PyFloat_Check(object)) return real(PyFloat_AS_DOUBLE(object));
        if (PyDict_Check(object)) return members(py::reinterpret_borrow<py::dict>(value));
        if (PyList_Check(object) || PyTuple_Check(object)) return elements(value);
        if (py::hasattr(value, "tolist")) return read(value.attr("tolist")());
        if (py::hasattr(value, "keys"))
            return members(py::dict(py::reinterpret_borrow<py::object>(value)));
        if (PySequence_Check(object) && !PyBytes_Check(object)) {
            return elements(py::list(py::reinterpret_borrow<py::object>(value)));
        }
        throw py::type_error("a sidecar holds JSON values only; at " + pointer() + ": found " +
                             std::string(py::str(py::type::of(value).attr("__name__"))));
    }

private:
    [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
        throw SidecarError(file_, pointer(), found, expected);
    }

    std::string pointer() const {
        std::string path;
        for (const std::string& step : path_) path += pointer_token(step);
        return path;
    }

    Json within(const std::string& step, const py::handle& value) {
        path_.push_back(step);
        if (path_.size() > kMaxDepth) {
            fail("nesting deeper than " + std::to_string(kMaxDepth), "flatter values");
        }
        Json result = read(value);
        path_.pop_back();
        return result;
    }

    std::string text(PyObject* object) const {
        Py_ssize_t size = 0;
        const char* const bytes = PyUnicode_AsUTF8AndSize(object, &size);
        if (bytes == nullptr) {
            PyErr_Clear();
            fail("a text with a lone surrogate", "Unicode text");
        }
        return {bytes, static_cast<std::size_t>(size)};
    }

    Json integer(PyObject* object) const {
        int overflow = 0;
        const long long number = PyLong_AsLongLongAndOverflow(object, &overflow);
        if (overflow == 0) return number;
        const double large = PyLong_AsDouble(object);
        if (PyErr_Occurred()) {
            PyErr_Clear();
            fail("a number too large for a double", "a finite number");
        }
        static_cast<void>(large);
        return long_integer(py::str(py::handle(object)));
    }

    Json real(double number) const {
        if (!std::isfinite(number)) {
            fail(std::isnan(number) ? "NaN" : "an infinite number", "a finite number");
        }
        return number;
    }

    Json members(const py::dict& object) {
        Json result = Json::object();
        auto& listed = static_cast<Json::object_t::Container&>(result.get_ref<Json::object_t&>());
        listed.reserve(object.size());
        for (const auto& [name, value] : object) {
            if (!PyUnicode_Check(name.ptr())) {
                throw py::type_error("a sidecar's names are texts; at " + pointer() + ": found " +
                                     std::string(py::repr(name)));
            }
            std::string key = text(name.ptr());
            Json member = within(key, value);
            listed.emplace_back(std::move(key), std::move(member));
        }
        return result;
    }

    Json elements(const py::handle& list) {
        Json result = Json::array();
        auto& listed = result.get_ref<Json::array_t&>();
        listed.reserve(py::len(list));
        for (const py::handle& value : list) {
            listed.push_back(within(std::to_string(listed.size()), value));
        }
        return result;
    }

    const std::string& file_;
    std::vector<std::string> path_;
    std::size_t values_ = 0;
};

}  // namespace

Json json_from(const py::handle& value, const std::string& file) {
    return Reader(file).read(value);
}

py::object python_from(const Json& value) {
    switch (value.type()) {
        case Json::value_t::object: {
            py::dict result;
            for (const auto& [name, member] : value.get_ref<const Json::object_t&>()) {
                result[py::str(name)] = python_from(member);
            }
            return std::move(result);
        }
        case Json::value_t::array: {
            py::list result(value.size());
            for (std::size_t i = 0; i < value.size(); ++i) result[i] = python_from(value[i]);
            return std::move(result);
        }
        case Json::value_t::string:
            return py::str(value.get_ref<const std::string&>());
        case Json::value_t::boolean:
            return py::bool_(value.get<bool>());
        case Json::value_t::number_integer:
            return py::int_(value.get<std::int64_t>());
        case Json::value_t::number_unsigned:
            return py::int_(value.get<std::uint64_t>());
        case Json::value_t::number_float:
            return py::float_(value.get<double>());
        case Json::value_t::binary:
            return py::module_::import("builtins").attr("int")(digits_of(value));
        default:
            return py::none();
    }
}

}  // namespace palette4d::bindings
