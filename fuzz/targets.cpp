#include "fuzz/targets.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "palpate/contact/contact_options.h"
#include "palpate/core/errors.h"
#include "palpate/core/settings.h"
#include "palpate/elastic/material.h"
#include "palpate/feedback/forces_file.h"
#include "palpate/feedback/sensor_log.h"
#include "palpate/infer/inference_parameters.h"
#include "palpate/instrument/onnx_header.h"
#include "palpate/instrument/tip_track.h"
#include "palpate/simulate/simulate_options.h"
#include "palpate/stereo/recording.h"
#include "palpate/stereo/rig.h"
#include "palpate/volume/attachments.h"
#include "palpate/volume/polygon_soup.h"
#include "study/plan.h"

namespace palpate::fuzz {

namespace {

/// A folder in memory, of this process, removed at its end.
class Scratch {
 public:
  Scratch() : folder_(fmt::format("/dev/shm/palpate_fuzz_{}", getpid())) {
    std::filesystem::create_directories(folder_);
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::filesystem::path file(const std::string& name, std::string_view bytes) const {
    std::ofstream(folder_ / name, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return folder_ / name;
  }

 private:
  std::filesystem::path folder_;
};

std::filesystem::path as_file(const std::string& name, std::string_view bytes) {
  static const Scratch kScratch;
  return kScratch.file(name, bytes);
}

template <class Read>
std::optional<double> unless_refused(const Read& read) {
  try {
    return read();
  } catch (const BadInput&) {
    return std::nullopt;
  }
}

std::optional<double> read_calibration(std::string_view bytes) {
  return unless_refused([&] { return read_rig(as_file("calibration.yaml", bytes)).baseline_mm(); });
}

/// A scene file without the groups that need all of the program behind them; those left have every kind of key.
std::optional<double> read_scene(std::string_view bytes) {
  return unless_refused([&] {
    RecordingOptions recording;
    TissueOptions tissue;
    AttachmentOptions attachments;
    ContactOptions contact;
    SimulateOptions simulate;
    InferenceParameters tuning;
    Settings settings;
    settings.group("recording", "", [&](Settings& group) { describe(group, recording); });
    settings.group("tissue", "", [&](Settings& group) { describe(group, tissue); });
    settings.group("contact", "", [&](Settings& group) { describe(group, contact); });
    settings.group("simulate", "", [&](Settings& group) { describe(group, simulate); });
    settings.group("tuning", "", [&](Settings& group) { describe(group, tuning); });
    describe(settings, attachments);
    read_settings_file(as_file("scene.yaml", bytes), settings);
    return tissue.young_modulus_kPa + contact.footprint_radius_mm;
  });
}

std::optional<double> read_study_file(std::string_view bytes) {
  return unless_refused([&] {
    const study::Study study = study::read_study(as_file("study.yaml", bytes), false);
    return static_cast<double>(study.title.size() + 1000 * study.experiments.size());
  });
}

std::optional<double> read_forces_table(std::string_view bytes) {
  return unless_refused([&] {
    double sum = 0;
    for (const ForceRow& row : read_forces(as_file("forces.csv", bytes))) sum += row.frame;
    return sum;
  });
}

std::optional<double> read_sensor_table(std::string_view bytes) {
  return unless_refused([&] { return read_sensor_log(as_file("sensor.csv", bytes), 4).front().force_N.z(); });
}

std::optional<double> read_track(std::string_view bytes) {
  return unless_refused([&] { return read_tip_track(as_file("tip.csv", bytes)).rows.begin()->second.tip_mm.z(); });
}

std::optional<double> read_network(std::string_view bytes) {
  const OnnxHeader header = read_onnx_header(bytes);
  if (header.input.empty()) return std::nullopt;
  double sum = static_cast<double>(header.last_operation.size());
  for (const int size : header.input) sum += size;
  return sum;
}

template <CellSoup (*Read)(std::string_view)>
std::optional<double> read_mesh(std::string_view bytes) {
  return unless_refused([&] {
    const Surface skin = skin_of(Read(bytes));
    return static_cast<double>(skin.triangles.size()) + (skin.vertices_mm.empty() ? 0 : skin.vertices_mm.front().x());
  });
}

}  // namespace

const std::vector<Target>& targets() {
  static const std::vector<Target> kTargets = {
      {"calibration", ".yaml", read_calibration},  {"scene", ".yaml", read_scene},
      {"study", ".yaml", read_study_file},         {"forces", ".csv", read_forces_table},
      {"sensor", ".csv", read_sensor_table},       {"tip_track", ".csv", read_track},
      {"network", ".onnx", read_network},          {"gmsh", ".msh", read_mesh<read_gmsh>},
      {"vtk", ".vtk", read_mesh<read_vtk_legacy>}, {"vtu", ".vtu", read_mesh<read_vtk_xml>},
      {"obj", ".obj", read_mesh<read_obj>},        {"ply", ".ply", read_mesh<read_ply>},
      {"stl", ".stl", read_mesh<read_stl>}};
  return kTargets;
}

const Target& target_called(const std::string& name) {
  std::string names;
  for (const Target& target : targets()) {
    if (target.name == name) return target;
    names += " " + target.name;
  }
  throw std::invalid_argument(fmt::format("no reader is called '{}', expected one of{}", name, names));
}

}  // namespace palpate::fuzz
