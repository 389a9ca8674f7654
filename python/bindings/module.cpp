#include "palpate/core/errors.h"
#include "python/bindings/parts.h"

PYBIND11_MODULE(_core, module) {
  namespace py = pybind11;
  py::options options;
  options.disable_function_signatures();  // palpate/_core.pyi has them
  module.doc() = "Force and stress from stereo endoscope video. Lengths in mm, left camera frame.";
  module.attr("__version__") = PALPATE_VERSION;
  py::register_exception<palpate::BadInput>(module, "BadInput", PyExc_ValueError).doc() =
      "The input cannot be used; one sentence says what, and what was expected.";
  py::register_exception<palpate::Unfinished>(module, "Unfinished", PyExc_RuntimeError).doc() =
      "The work stopped half-way through no fault of the settings: a cut video, a full disk.";
  palpate::python::add_options(module);
  palpate::python::add_recording(module);
  palpate::python::add_tissue_map(module);
  palpate::python::add_force_estimator(module);
}
