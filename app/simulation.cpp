#include "app/simulation.h"

#include "app/progress.h"
#include "app/runtime.h"
#include "palpate/core/errors.h"
#include "palpate/core/whole_file.h"
#include "palpate/session/clear_results.h"
#include "palpate/simulate/uterus_demo.h"

namespace palpate::app {

namespace {
/// The paper's map has 550 elements.
constexpr int kDemoElements = 550;
}  // namespace

SceneFile demo_scene() {
  const SimulatedCase demo = uterus_demo();
  SceneFile scene_file;
  scene_file.file = "demo.yaml";
  scene_file.simulate = demo.simulate;
  scene_file.has_simulate = true;
  scene_file.scene.tissue = demo.tissue;
  scene_file.scene.attachments = demo.attachments;
  scene_file.scene.contact = demo.contact;
  scene_file.scene.map.elements = kDemoElements;
  return scene_file;
}

SceneFile simulate_into(const SceneFile& simulated, const std::filesystem::path& folder, bool quiet,
                        DejaVuSummary& summary) {
  begin_sequence(folder, simulated.file);
  {
    Progress progress("simulate", quiet);
    summary = simulate_dejavu(simulated.simulate, simulated.scene.tissue, simulated.scene.attachments,
                              simulated.scene.contact, folder, [&progress](int done, int total) {
                                progress.show(done, total);
                                if (interrupted()) throw Unfinished("interrupted while the sequence was made");
                              });
  }
  SceneFile estimated = simulated;
  estimated.has_simulate = false;
  estimated.has_recording = true;
  estimated.file = folder / "scene.yaml";
  Scene& scene = estimated.scene;
  scene.recording.left = "left.mp4";
  scene.recording.right = "right.mp4";
  scene.recording.calibration = "calibration.yaml";
  scene.map.organ_region_px = summary.organ_region_px;
  scene.map.thickness_mm = summary.thickness_mm;
  scene.contact.footprint_radius_mm = summary.contact_radius_mm;
  scene.contact.grip = summary.grip;
  write_whole_file(estimated.file, write_scene_file(estimated));
  return read_scene_file(estimated.file, true);
}

}  // namespace palpate::app
