#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet::python {

namespace py = pybind11;

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Whole numbers from an array of any integer type, or from a list; one of int32 is taken without a
/// copy. Made by its type caster alone, which throws Error for other types and numbers.
struct IntArray : py::array_t<std::int32_t, py::array::c_style> {
    using py::array_t<std::int32_t, py::array::c_style>::array_t;
    using View = py::array_t<std::int32_t, py::array::c_style>;
    explicit IntArray(const View& view) : View(view) {}
};

/// Read-only view of numbers that `owner` keeps alive.
template <class T>
py::array view(const T* data, std::vector<py::ssize_t> shape, py::handle owner) {
    py::array_t<T> array(std::move(shape), data, owner);
    array.attr("setflags")(false);
    return array;
}
/// Of shape (n, 3).
inline py::array view(const std::vector<Vector3>& values, py::handle owner) {
    return view(reinterpret_cast<const double*>(values.data()), {std::ssize(values), 3}, owner);
}

/// An array that takes over the numbers.
template <class T>
py::array owned(std::vector<T> values, std::vector<py::ssize_t> shape) {
    auto* kept = new std::vector<T>(std::move(values));
    const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
    using Number = std::conditional_t<std::is_same_v<T, Vector3>, double, T>;
    return py::array_t<Number>(std::move(shape), reinterpret_cast<const Number*>(kept->data()),
                               owner);
}
/// Of shape (n, 3).
inline py::array owned(std::vector<Vector3> values) {
    const py::ssize_t count = std::ssize(values);
    return owned(std::move(values), {count, 3});
}

/// A copy of a fixed-size matrix, by rows.
template <class Matrix>
py::array matrix(const Matrix& m) {
    py::array_t<double> array(
        {static_cast<py::ssize_t>(m.rows()), static_cast<py::ssize_t>(m.cols())});
    auto out = array.mutable_unchecked<2>();
    for (Eigen::Index i = 0; i < m.rows(); ++i)
        for (Eigen::Index j = 0; j < m.cols(); ++j) out(i, j) = m(i, j);
    return array;
}
inline py::array vector(const Vector3& v) { return py::array_t<double>(3, v.data()); }

/// The rows of an array of shape (n, 3). Throws Error, naming it, for another shape.
inline std::span<const Vector3> rows3(const DoubleArray& array, const char* name) {
    if (array.ndim() != 2 || array.shape(1) != 3)
        fail("{}: found an array of {} dimensions{}, expected shape (n, 3)", name, array.ndim(),
             array.ndim() == 2 ? fmt::format(" with {} columns", array.shape(1)) : "");
    return {reinterpret_cast<const Vector3*>(array.data()),
            static_cast<std::size_t>(array.shape(0))};
}
/// The numbers of an array of one dimension. Throws Error likewise.
template <class Array>
auto numbers(const Array& array, const char* name) {
    if (array.ndim() != 1)
        fail("{}: found an array of {} dimensions, expected one", name, array.ndim());
    return std::span(array.data(), static_cast<std::size_t>(array.shape(0)));
}

}  // namespace livetet::python

namespace pybind11::detail {

template <>
struct type_caster<livetet::python::IntArray> {
    PYBIND11_TYPE_CASTER(livetet::python::IntArray, const_name("numpy.ndarray[numpy.int32]"));

    bool load(handle source, bool /*convert*/) {
        using View = livetet::python::IntArray::View;
        if (isinstance<View>(source)) {
            value = livetet::python::IntArray(reinterpret_borrow<View>(source));
            return true;
        }
        const array any = array::ensure(source);
        if (!any || any.dtype().kind() == 'U' || any.dtype().kind() == 'O') return false;
        const bool is_whole = any.dtype().kind() == 'i' || any.dtype().kind() == 'u';
        if (!is_whole && any.size() > 0)
            livetet::fail("found an array of {}, expected whole numbers",
                          str(any.dtype()).cast<std::string>());
        const auto wide = array_t<std::int64_t, array::c_style | array::forcecast>::ensure(any);
        View narrow(std::vector<ssize_t>(wide.shape(), wide.shape() + wide.ndim()));
        for (ssize_t i = 0; i < wide.size(); ++i) {
            if (!std::in_range<std::int32_t>(wide.data()[i]))
                livetet::fail("found {}, expected whole numbers of 32 bits", wide.data()[i]);
            narrow.mutable_data()[i] = static_cast<std::int32_t>(wide.data()[i]);
        }
        value = livetet::python::IntArray(narrow);
        return true;
    }
};

}  // namespace pybind11::detail
