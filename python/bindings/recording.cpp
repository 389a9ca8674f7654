#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <Eigen/LU>

#include <mutex>

#include "palpate/core/errors.h"
#include "palpate/stereo/recording.h"
#include "python/bindings/arrays.h"
#include "python/bindings/parts.h"

namespace palpate::python {

namespace {

using Size = std::pair<int, int>;

StereoFrame make_frame(const py::array& left, const py::array& right, int index, double time_s) {
  StereoFrame frame{index, time_s, image_of(left, "left"), image_of(right, "right")};
  if (frame.left.size() != frame.right.size()) throw BadInput("left and right differ in size");
  return frame;
}

Camera camera_of(const py::array& K, const py::array& distortion, const std::string& side) {
  Camera camera;
  camera.K = cv::Matx33d(numbers_of(K, side + "_K", {3, 3}).data());
  const auto flat = distortion.attr("ravel")().cast<py::array>();
  camera.distortion = numbers_of(flat, side + "_distortion", {flat.size()});
  return camera;
}

StereoRig make_rig(const py::array& left_K, const py::array& left_distortion, const py::array& right_K,
                   const py::array& right_distortion, const py::array& rotation, const py::array& translation_mm,
                   const Size& size) {
  StereoRig rig;
  rig.image_size = {size.first, size.second};
  rig.left = camera_of(left_K, left_distortion, "left");
  rig.right = camera_of(right_K, right_distortion, "right");
  const std::vector<double> R = numbers_of(rotation, "right_from_left", {3, 3});
  rig.right_from_left = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data());
  const auto flat = translation_mm.attr("ravel")().cast<py::array>();
  rig.right_from_left_mm = Eigen::Map<const Vec3>(numbers_of(flat, "right_from_left_mm", {3}).data());
  if ((rig.right_from_left * rig.right_from_left.transpose() - Mat3::Identity()).norm() > 1e-3 ||
      rig.right_from_left.determinant() < 0)
    throw BadInput("right_from_left: is not a rotation");
  if (rig.baseline_mm() < 1 || rig.baseline_mm() > 200)
    throw BadInput("right_from_left_mm: a baseline is 1 to 200 mm long, this one " + std::to_string(rig.baseline_mm()));
  return rig;
}

/// One frame at a time, whichever thread asks.
struct SharedRecording {
  explicit SharedRecording(const RecordingOptions& options) : recording(options) {}
  Recording recording;
  std::mutex one_at_a_time;

  std::optional<StereoFrame> next() {
    const std::lock_guard lock(one_at_a_time);
    return recording.next();
  }
};

}  // namespace

void add_recording(py::module_& module) {
  py::class_<StereoFrame>(module, "StereoFrame", "Both images of one moment, as recorded.")
      .def(py::init(&make_frame), py::arg("left"), py::arg("right"), py::arg("index") = 0, py::arg("time_s") = 0.0,
           "From two arrays (height, width, 3) of uint8, BGR, any strides; they are copied. Raises BadInput.")
      .def_readonly("index", &StereoFrame::index, "number of the frame")
      .def_readonly("time_s", &StereoFrame::time_s, "since the first frame, s")
      .def_property_readonly("left", array_of(&StereoFrame::left),
                             "(height, width, 3) uint8, BGR; (0, 0) where a live camera is silent")
      .def_property_readonly("right", array_of(&StereoFrame::right),
                             "(height, width, 3) uint8, BGR; (0, 0) where the right camera has no picture");

  py::class_<StereoRig>(module, "StereoRig", "A calibrated pair of cameras: x_right = R x_left + T.")
      .def(py::init(&make_rig), py::arg("left_K"), py::arg("left_distortion"), py::arg("right_K"),
           py::arg("right_distortion"), py::arg("right_from_left"), py::arg("right_from_left_mm"), py::arg("size"),
           "From what cv2.stereoCalibrate returns: K (3, 3) px, distortion (k1, k2, p1, p2, k3, ...), R (3, 3), T (3,) "
           "mm, "
           "size (width, height). Raises BadInput.")
      .def_property_readonly(
          "left_K", [](const py::object& self) { return view(self, self.cast<const StereoRig&>().left.K); },
          "(3, 3), px")
      .def_property_readonly(
          "right_K", [](const py::object& self) { return view(self, self.cast<const StereoRig&>().right.K); },
          "(3, 3), px")
      .def_property_readonly("right_from_left", array_of(&StereoRig::right_from_left), "rotation (3, 3)")
      .def_property_readonly("right_from_left_mm", array_of(&StereoRig::right_from_left_mm), "translation (3,), mm")
      .def_property_readonly("baseline_mm", &StereoRig::baseline_mm, "mm");
  module.def("read_rig", py::overload_cast<const RecordingOptions&>(&read_rig), py::arg("recording"),
             py::call_guard<py::gil_scoped_release>(), "The rig of a recording's images. Raises BadInput.");

  py::class_<Rectification>(module, "Rectification", "Look-up tables and geometry of the rectified pair.")
      .def_property_readonly(
          "size", [](const Rectification& self) { return Size(self.size.width, self.size.height); },
          "(width, height), px")
      .def_readonly("focal_px", &Rectification::focal_px, "px")
      .def_readonly("baseline_mm", &Rectification::baseline_mm, "mm")
      .def_property_readonly("rectified_from_left", array_of(&Rectification::rectified_from_left), "rotation (3, 3)");
  module.def(
      "make_rectification",
      [](const StereoRig& rig, const Size& size) {
        return make_rectification(rig, {size.first, size.second});
      },
      py::arg("rig"), py::arg("size"), py::call_guard<py::gil_scoped_release>(),
      "Once per recording; size = (width, height) of its images, px.");

  py::class_<SharedRecording>(module, "Recording", "Frames of a stereo recording, one after the other; an iterator.")
      .def(py::init<const RecordingOptions&>(), py::arg("options"), py::call_guard<py::gil_scoped_release>(),
           "Raises BadInput: a video is missing or empty, left and right differ in size, ...")
      .def("__iter__", [](py::object self) { return self; })
      .def(
          "__next__",
          [](SharedRecording& self) {
            auto frame = self.next();
            if (!frame) throw py::stop_iteration();
            return std::move(*frame);
          },
          py::call_guard<py::gil_scoped_release>(), "The next StereoFrame. Raises Unfinished where a file is cut.")
      .def_property_readonly(
          "size",
          [](const SharedRecording& self) { return Size(self.recording.size().width, self.recording.size().height); },
          "(width, height) of one camera's images, px")
      .def_property_readonly(
          "fps", [](const SharedRecording& self) { return self.recording.fps(); }, "frames per second, mean")
      .def_property_readonly(
          "frame_count", [](const SharedRecording& self) { return self.recording.frame_count(); },
          "of the left camera; -1 = not known")
      .def_property_readonly(
          "notes", [](const SharedRecording& self) { return self.recording.notes(); },
          "sentences on the files that one ought to know");
}

}  // namespace palpate::python
