#include "palpate/estimate/force_estimator.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <mutex>

#include "palpate/core/errors.h"
#include "python/bindings/arrays.h"
#include "python/bindings/parts.h"

namespace palpate::python {

namespace {

/// One frame at a time, whichever thread asks.
class SharedEstimator {
 public:
  SharedEstimator(const TissueMap& map, const StereoFrame& static_frame, const Rectification& rectification,
                  const InstrumentOptions& instrument, const ContactOptions& contact, const InferenceParameters& tuning,
                  const ForceUncertainty& uncertainty)
      : size_(rectification.size),
        estimator_(map, static_frame, rectification, instrument, contact, tuning, uncertainty) {}

  ForceEstimate update(const StereoFrame& frame) {
    if (!frame.left.empty() && frame.left.size() != size_)  // a live camera that is silent gives none
      throw BadInput(fmt::format("frame {} is {} x {} px, and the recording {} x {} px", frame.index, frame.left.cols,
                                 frame.left.rows, size_.width, size_.height));
    const std::lock_guard lock(one_at_a_time_);
    return estimator_.update(frame);
  }

  const TissueMap& map() const { return estimator_.map(); }

 private:
  cv::Size size_;
  ForceEstimator estimator_;
  std::mutex one_at_a_time_;
};

}  // namespace

void add_force_estimator(py::module_& module) {
  py::class_<ForceBand>(module, "ForceBand", "2.5 and 97.5 % quantiles of the force's magnitude.")
      .def_readonly("low_N", &ForceBand::low_N, "N")
      .def_readonly("high_N", &ForceBand::high_N, "N");

  py::class_<ForceEstimate>(module, "ForceEstimate",
                            "The answer to one frame for one instrument. Forces of the instrument on the tissue.")
      .def_readonly("frame", &ForceEstimate::frame, "number of the frame")
      .def_readonly("time_s", &ForceEstimate::time_s, "s")
      .def_property_readonly(
          "status", [](const ForceEstimate& self) { return status_name(self.status); },
          "ok, no_contact, tool_lost, not_converged or map_stale")
      .def_readonly("in_contact", &ForceEstimate::in_contact)
      .def_property_readonly("force_N", array_of(&ForceEstimate::force_N), "(3,), N")
      .def_readonly("mean_nodal_force_N", &ForceEstimate::mean_nodal_force_N, "F_f of the paper, N")
      .def_property_readonly("tip_mm", array_of(&ForceEstimate::tip_mm), "(3,), mm; not to be read where tool_lost")
      .def_property_readonly(
          "stiffness_N_per_mm",
          [](const py::object& self) {
            return view(self, self.cast<const ForceEstimate&>().tangent.stiffness_N_per_mm);
          },
          "(3, 3), how the force follows the tip, N/mm")
      .def_readonly("max_von_mises_kPa", &ForceEstimate::max_von_mises_kPa, "kPa")
      .def_readonly("residual", &ForceEstimate::residual)
      .def_readonly("misfit_mm", &ForceEstimate::misfit_mm, "mm")
      .def_readonly("band", &ForceEstimate::band, "from the images, at the stated tissue")
      .def_readonly("total_band", &ForceEstimate::total_band, "with what is not known of the tissue")
      .def_property_readonly(
          "grip", [](const ForceEstimate& self) { return hold_name(self.grip); }, "free, grasp, push or slide")
      .def_readonly("p_contact", &ForceEstimate::p_contact, "0 to 1")
      .def_readonly("footprint_mm", &ForceEstimate::footprint_mm, "radius as estimated, mm")
      .def_property_readonly("scene_mm", array_of(&ForceEstimate::scene_mm), "(3,), motion of the tissue's middle, mm")
      .def_property_readonly(
          "warnings", [](const ForceEstimate& self) { return self.warnings; }, "names, as in forces.csv")
      .def_property_readonly(
          "total_ms", [](const ForceEstimate& self) { return self.times.total_ms(); }, "ms")
      .def_property_readonly(
          "further", [](const ForceEstimate& self) { return self.further; }, "of the further instruments")
      .def_property_readonly("deformed_nodes_mm", array_of(&ForceEstimate::deformed_nodes_mm),
                             "(n, 3), mm; finer than the map's around a contact, empty where nothing was computed")
      .def_property_readonly("boundary", array_of(&ForceEstimate::boundary),
                             "(m, 3), outward triangles of these nodes that were seen")
      .def_property_readonly("node_von_mises_kPa", array_of(&ForceEstimate::node_von_mises_kPa), "(n,), kPa")
      .def_property_readonly("instrument_mask", array_of(&ForceEstimate::left_instrument_mask),
                             "(height, width) uint8 of the rectified left image, 255 = instrument");

  py::class_<ForceUncertainty>(module, "ForceUncertainty", "What the force varies by with the tissue.")
      .def(py::init<>());
  module.def("force_uncertainty", &force_uncertainty, py::arg("map"), py::arg("rectification"), py::arg("options"),
             py::arg("uncertainty"), py::arg("radius_mm"), py::call_guard<py::gil_scoped_release>(),
             "For ForceEstimator: an ensemble of maps, each with one assumption changed. Raises BadInput.");

  py::class_<SharedEstimator>(module, "ForceEstimator", "The compute stage: every frame from two images to a force.")
      .def(py::init<const TissueMap&, const StereoFrame&, const Rectification&, const InstrumentOptions&,
                    const ContactOptions&, const InferenceParameters&, const ForceUncertainty&>(),
           py::arg("map"), py::arg("static_frame"), py::arg("rectification"), py::arg("instrument"), py::arg("contact"),
           py::arg("tuning") = InferenceParameters(), py::arg("uncertainty") = ForceUncertainty(),
           py::call_guard<py::gil_scoped_release>(), "static_frame: the frame that the map was built from.")
      .def("update", &SharedEstimator::update, py::arg("frame"), py::call_guard<py::gil_scoped_release>(),
           "Frames in order of time. Raises BadInput for a frame of another size; else the status says what happened.")
      .def_property_readonly("map", &SharedEstimator::map, py::return_value_policy::reference_internal);
}

}  // namespace palpate::python
