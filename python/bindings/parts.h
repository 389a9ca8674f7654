#pragma once

#include <pybind11/pybind11.h>

#include "palpate/core/settings.h"

namespace palpate::python {

/// Each adds its part of the module.
void add_options(pybind11::module_& module);
void add_recording(pybind11::module_& module);
void add_tissue_map(pybind11::module_& module);
void add_force_estimator(pybind11::module_& module);

/// Every key with its value, as in the scene file.
template <class Options>
std::string yaml_of(const Options& options) {
  Options copy = options;
  Settings settings;
  describe(settings, copy);
  return write_settings(settings);
}

}  // namespace palpate::python
