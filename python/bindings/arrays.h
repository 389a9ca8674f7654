#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"

/// NumPy arrays that look into the values of a Python object: read-only, and the array keeps the object alive. What
/// goes the other way is checked and copied.
namespace palpate::python {

namespace py = pybind11;
using Shape = std::vector<py::ssize_t>;

template <class T>
py::array view(const py::object& owner, const T* data, const Shape& shape, const Shape& strides = {}) {
  py::array array(py::dtype::of<T>(), shape, strides, data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

template <class T>
py::array view(const py::object& owner, const std::vector<T>& values) {
  return view(owner, values.data(), {static_cast<py::ssize_t>(values.size())});
}

template <class T, size_t N>
py::array view(const py::object& owner, const std::vector<std::array<T, N>>& rows) {
  return view(owner, rows.empty() ? nullptr : rows[0].data(), {static_cast<py::ssize_t>(rows.size()), N});
}

py::array view(const py::object& owner, const std::vector<Vec3>& points);
py::array view(const py::object& owner, const std::vector<cv::Vec3b>& colours);
py::array view(const py::object& owner, const Vec3& vector);
py::array view(const py::object& owner, const Mat3& matrix);
py::array view(const py::object& owner, const cv::Matx33d& matrix);
/// Of 8 bits or floats, one channel or three; an empty one is 0 x 0.
py::array view(const py::object& owner, const cv::Mat& image);

/// The getter of a property that is a view.
template <class Class, class Value>
auto array_of(Value Class::*member) {
  return [member](const py::object& self) { return view(self, self.cast<const Class&>().*member); };
}

/// (height, width, 3) of uint8, BGR, any strides. Throws BadInput in one sentence, which calls it `name`.
cv::Mat image_of(const py::array& array, const std::string& name);
/// (n, 3) of numbers. Throws BadInput.
std::vector<Vec3> points_of(const py::array& array, const std::string& name);
/// (n, columns) of whole numbers, each at least 0 and below `limit`. Throws BadInput.
std::vector<std::vector<int>> indices_of(const py::array& array, const std::string& name, int columns, size_t limit);
/// The numbers of an array of this shape. Throws BadInput.
std::vector<double> numbers_of(const py::array& array, const std::string& name, const Shape& shape);

}  // namespace palpate::python
