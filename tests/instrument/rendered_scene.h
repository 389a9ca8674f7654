#pragma once

#include <array>

#include "palpate/simulate/instrument_look.h"
#include "palpate/simulate/render.h"
#include "palpate/stereo/rig.h"

namespace palpate::test {

enum class Tissue { red, fat, tendon, pale, brown };

/// Tissue of many kinds with instruments of many kinds before it, rendered, with what each pixel shows.
class RenderedScene {
 public:
  /// `height` of the images in px; they are 16 to 9.
  RenderedScene(Tissue tissue, const std::vector<SimulatedInstrument>& instruments, int height = 270);

  /// `tips_mm`: of each instrument, which enters from where its options say; none of it is in view without one.
  /// `tissue_mm`: by which the tissue has moved. `blur_mm`: way of the instruments while the shutter is open.
  RectifiedPair draw(const std::vector<Vec3>& tips_mm, int index, const Vec3& tissue_mm = Vec3::Zero(),
                     const Vec3& blur_mm = Vec3::Zero());
  /// 255 where an camera saw the instrument in the middle of the last draw.
  cv::Mat truth_mask(size_t instrument, int camera);

  Rectification rectification() const;

 private:
  SimulatedCamera camera_;
  SimulatedLook look_;
  std::vector<SimulatedInstrument> instruments_;
  Surface organ_;
  Renderer renderer_;
  int organ_number_ = 0;
  std::vector<int> numbers_;

  void place(const std::vector<Vec3>& tips_mm);
};

}  // namespace palpate::test
