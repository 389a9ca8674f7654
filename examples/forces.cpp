#include <cstdio>

#include "palpate/palpate.h"

int main(int, char** arguments) {
  using namespace palpate;
  const Scene scene = read_scene(arguments[1]);
  Recording recording(scene.recording);
  const Rectification rectification = make_rectification(read_rig(scene.recording), recording.size());
  const StereoFrame rest = *recording.next();
  TissueMap map = build_tissue_map(rest, rectification, scene.map, scene.tissue, scene.attachments);
  ForceEstimator estimator(map, rest, rectification, scene.instrument, scene.contact);
  while (const auto frame = recording.next()) {
    const ForceEstimate estimate = estimator.update(*frame);
    std::printf("%d %s %.3f N\n", estimate.frame, status_name(estimate.status).c_str(), estimate.force_N.norm());
  }
}
