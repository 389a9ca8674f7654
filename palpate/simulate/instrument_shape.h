#pragma once

#include "palpate/simulate/simulate_options.h"

namespace palpate {

/// Where the instrument is: its tip (far end of the jaws, on the shaft's axis) and the unit direction from shaft to
/// tip.
struct InstrumentPlace {
  Vec3 tip_mm = Vec3::Zero();
  Vec3 axis = Vec3::UnitZ();
  double opening = 0;  ///< of the jaws, 0 .. 1
};

/// Triangles of the instrument in place, left camera frame. The triangles are the same for every place of one model;
/// edges are sharp where parts meet.
Surface make_instrument(const SimulatedInstrument& instrument, const InstrumentPlace& place);

}  // namespace palpate
