#include "python/bindings/arrays.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "palpate/core/errors.h"

namespace palpate::python {

namespace {

std::string kind_of(const py::array& array) {
  const Shape shape(array.shape(), array.shape() + array.ndim());
  return fmt::format("{} ({})", py::str(array.dtype()).cast<std::string>(), fmt::join(shape, ", "));
}

[[noreturn]] void refuse(const std::string& name, const std::string& expected, const py::array& array) {
  throw BadInput(fmt::format("{}: expected {}, got {}", name, expected, kind_of(array)));
}

bool is_whole(const py::array& array) {
  return array.dtype().kind() == 'i' || array.dtype().kind() == 'u';
}

bool is_number(const py::array& array) {
  return is_whole(array) || array.dtype().kind() == 'f';
}

py::array_t<double> doubles_of(const py::array& array) {
  return py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(array);
}

}  // namespace

py::array view(const py::object& owner, const std::vector<Vec3>& points) {
  return view(owner, points.empty() ? nullptr : points[0].data(), {static_cast<py::ssize_t>(points.size()), 3});
}

py::array view(const py::object& owner, const std::vector<cv::Vec3b>& colours) {
  return view(owner, colours.empty() ? nullptr : colours[0].val, {static_cast<py::ssize_t>(colours.size()), 3});
}

py::array view(const py::object& owner, const Vec3& vector) {
  return view(owner, vector.data(), {3});
}

py::array view(const py::object& owner, const Mat3& matrix) {
  return view(owner, matrix.data(), {3, 3}, {sizeof(double), 3 * sizeof(double)});  // columns first
}

py::array view(const py::object& owner, const cv::Matx33d& matrix) {
  return view(owner, matrix.val, {3, 3});
}

py::array view(const py::object& owner, const cv::Mat& image) {
  if (image.empty()) return view<uint8_t>(owner, nullptr, {0, 0});
  const auto step = static_cast<py::ssize_t>(image.step), pixel = static_cast<py::ssize_t>(image.elemSize());
  const auto part = static_cast<py::ssize_t>(image.elemSize1());
  Shape shape = {image.rows, image.cols}, strides = {step, pixel};
  if (image.channels() > 1) {
    shape.push_back(image.channels());
    strides.push_back(part);
  }
  if (image.depth() == CV_32F) return view(owner, image.ptr<float>(), shape, strides);
  return view(owner, image.ptr<uint8_t>(), shape, strides);
}

cv::Mat image_of(const py::array& array, const std::string& name) {
  if (!array.dtype().is(py::dtype::of<uint8_t>()) || array.ndim() != 3 || array.shape(2) != 3 || array.size() == 0)
    refuse(name, "uint8 (height, width, 3), BGR", array);
  const auto packed = py::array_t<uint8_t, py::array::c_style>::ensure(array);
  const cv::Mat lent(static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)), CV_8UC3,
                     const_cast<uint8_t*>(packed.data()));
  return lent.clone();
}

std::vector<Vec3> points_of(const py::array& array, const std::string& name) {
  if (!is_number(array) || array.ndim() != 2 || array.shape(1) != 3) refuse(name, "numbers (n, 3)", array);
  const auto numbers = doubles_of(array);
  std::vector<Vec3> points(static_cast<size_t>(array.shape(0)));
  for (size_t i = 0; i < points.size(); ++i) {
    points[i] = Eigen::Map<const Vec3>(numbers.data() + 3 * i);
    if (!points[i].allFinite()) throw BadInput(fmt::format("{}: row {} is not finite", name, i));
  }
  return points;
}

std::vector<std::vector<int>> indices_of(const py::array& array, const std::string& name, int columns, size_t limit) {
  if (!is_whole(array) || array.ndim() != 2 || array.shape(1) != columns)
    refuse(name, fmt::format("whole numbers (n, {})", columns), array);
  const auto numbers = py::array_t<int64_t, py::array::c_style | py::array::forcecast>::ensure(array);
  std::vector<std::vector<int>> rows(static_cast<size_t>(array.shape(0)));
  const int64_t* next = numbers.data();
  for (auto& row : rows)
    for (int column = 0; column < columns; ++column, ++next) {
      if (*next < 0 || *next >= static_cast<int64_t>(limit))
        throw BadInput(fmt::format("{}: {} is no number of the {} points", name, *next, limit));
      row.push_back(static_cast<int>(*next));
    }
  return rows;
}

std::vector<double> numbers_of(const py::array& array, const std::string& name, const Shape& shape) {
  if (!is_number(array) || Shape(array.shape(), array.shape() + array.ndim()) != shape)
    refuse(name, fmt::format("numbers ({})", fmt::join(shape, ", ")), array);
  const auto numbers = doubles_of(array);
  return {numbers.data(), numbers.data() + numbers.size()};
}

}  // namespace palpate::python
