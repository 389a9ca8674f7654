#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "palpate/estimate/scene.h"
#include "python/bindings/parts.h"

namespace palpate::python {

namespace py = pybind11;

void add_options(py::module_& module) {
  py::class_<RecordingOptions>(module, "RecordingOptions", "`recording` of the scene file: where the images are.")
      .def(py::init<>())
      .def_readwrite("left", &RecordingOptions::left, "video, image pattern (left_%04d.png) or device")
      .def_readwrite("right", &RecordingOptions::right, "the same of the right camera")
      .def_readwrite("stereo", &RecordingOptions::stereo, "both in one picture, instead of left and right")
      .def_readwrite("calibration", &RecordingOptions::calibration, "calibration file")
      .def_readwrite("swap", &RecordingOptions::swap, "left and right change places")
      .def_readwrite("fps", &RecordingOptions::fps, "frames per second; 0 = as the file says")
      .def("__str__", &yaml_of<RecordingOptions>);

  py::class_<MapOptions>(module, "MapOptions", "`map` of the scene file: how the map is built.")
      .def(py::init<>())
      .def_readwrite("frame", &MapOptions::frame, "the static frame")
      .def_readwrite("elements", &MapOptions::elements, "tetrahedra, n of the paper")
      .def_readwrite("thickness_mm", &MapOptions::thickness_mm, "mean thickness behind what is seen, mm")
      .def_readwrite("volume", &MapOptions::volume,
                     "closed surface or volume instead of the thickness, left camera frame")
      .def_property(
          "organ_region_px",
          [](const MapOptions& options) {
            std::vector<std::pair<double, double>> corners;
            for (const cv::Point2d& corner : options.organ_region_px) corners.emplace_back(corner.x, corner.y);
            return corners;
          },
          [](MapOptions& options, const std::vector<std::pair<double, double>>& corners) {
            options.organ_region_px.clear();
            for (const auto& [x, y] : corners) options.organ_region_px.emplace_back(x, y);
          },
          "corners (x, y) of the organ, px of the left image as recorded; [] = all")
      .def("__str__", &yaml_of<MapOptions>);

  py::class_<TissueOptions>(module, "TissueOptions", "`tissue` of the scene file, gamma of the paper.")
      .def(py::init<>())
      .def_property(
          "law", [](const TissueOptions& tissue) { return law_name(tissue.law); },
          [](TissueOptions& tissue, const std::string& name) {
            std::string names;
            for (const auto& [word, law] : law_words()) {
              if (word == name) {
                tissue.law = law;
                return;
              }
              names += (names.empty() ? "" : ", ") + word;
            }
            throw py::value_error("law: '" + name + "' is none of " + names);
          },
          "saint-venant-kirchhoff, saint-venant-kirchhoff-barrier, neo-hookean, corotated or linear")
      .def_readwrite("young_modulus_kPa", &TissueOptions::young_modulus_kPa, "Young's modulus, kPa")
      .def_readwrite("poisson_ratio", &TissueOptions::poisson_ratio, "Poisson's ratio, 0 to 0.5")
      .def("__str__", &yaml_of<TissueOptions>);

  py::class_<AttachmentOptions>(module, "AttachmentOptions",
                                "`attachments` of the scene file: what is held, b of the paper.")
      .def(py::init<>())
      .def("__str__", &yaml_of<AttachmentOptions>);

  py::class_<InstrumentOptions>(module, "InstrumentOptions", "`instrument` of the scene file: how its tip is found.")
      .def(py::init<>())
      .def_readwrite("segmentation", &InstrumentOptions::segmentation, "learned, colour, none or an ONNX network")
      .def_readwrite("track", &InstrumentOptions::track, "tip.csv instead of the images")
      .def("__str__", &yaml_of<InstrumentOptions>);

  py::class_<ContactOptions>(module, "ContactOptions", "`contact` of the scene file.")
      .def(py::init<>())
      .def_readwrite("threshold_mm", &ContactOptions::threshold_mm, "nearer than this the contact is armed, mm")
      .def_readwrite("footprint_radius_mm", &ContactOptions::footprint_radius_mm, "of the patch that the tip holds, mm")
      .def_readwrite("friction", &ContactOptions::friction, "Coulomb coefficient of a push")
      .def("__str__", &yaml_of<ContactOptions>);

  py::class_<UncertaintyOptions>(
      module, "UncertaintyOptions",
      "`uncertainty` of the scene file: what is not known of the tissue, one standard deviation.")
      .def(py::init<>())
      .def_readwrite("young_modulus_factor", &UncertaintyOptions::young_modulus_factor,
                     "1.3 = known to a factor of 1.3")
      .def_readwrite("poisson_ratio", &UncertaintyOptions::poisson_ratio, "of Poisson's ratio")
      .def_readwrite("thickness_mm", &UncertaintyOptions::thickness_mm, "of the thickness, mm")
      .def_readwrite("attachments_mm", &UncertaintyOptions::attachments_mm, "of the attachments' depth, mm")
      .def("__str__", &yaml_of<UncertaintyOptions>);

  py::class_<InferenceParameters>(module, "InferenceParameters", "`tuning` of the scene file.")
      .def(py::init<>())
      .def("__str__", &yaml_of<InferenceParameters>);

  py::class_<Scene>(module, "Scene", "Everything that a run is told: scene.yaml.")
      .def(py::init<>())
      .def_static("read", &read_scene, py::arg("file"), py::call_guard<py::gil_scoped_release>(),
                  "A scene file with its recording. Raises BadInput that names file, line and key.")
      .def_readwrite("recording", &Scene::recording)
      .def_readwrite("map", &Scene::map)
      .def_readwrite("tissue", &Scene::tissue)
      .def_readwrite("attachments", &Scene::attachments)
      .def_readwrite("instrument", &Scene::instrument)
      .def_readwrite("contact", &Scene::contact)
      .def_readwrite("uncertainty", &Scene::uncertainty)
      .def_readwrite("tuning", &Scene::tuning)
      .def("__str__", &yaml_of<Scene>);
}

}  // namespace palpate::python
