#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "palpate/stream/force_record.h"
#include "palpate/stream/stream_frame.h"

namespace palpate {

/// Header and body of one OpenIGTLink message (header version 1), as they go over the wire. Camera coordinates are
/// declared LPS and sent as RAS: x and y change their sign.
using IgtlBytes = std::shared_ptr<const std::vector<uint8_t>>;

/// PalpateTip TRANSFORM; that of the second instrument (1) is PalpateTip2, and so on for state and force.
IgtlBytes igtl_tip(const StreamFrame& frame, int instrument = 0);
/// PalpateState STRING.
IgtlBytes igtl_state(const StreamFrame& frame, const StreamScene& scene, int instrument = 0);
/// PalpateForce SENSOR: x, y, z in N (RAS) and 1 where they are valid, else four zeros.
IgtlBytes igtl_force(const Vec3& force_N, bool valid, int64_t wall_ns, int instrument = 0);
/// PalpateSurface POLYDATA: the body as it is deformed, and each force as an arrow that ends at its tip; von Mises
/// stress in kPa at each point. `frame` may be null: the body at rest.
IgtlBytes igtl_surface(const StreamFrame* frame, const StreamScene& scene);
/// PalpateOverlay IMAGE, RGB8: the picture upright, in the plane of the map's middle.
IgtlBytes igtl_overlay(const StreamFrame& frame, const StreamScene& scene);
/// PalpateStatus STATUS: 1 ok, 13 not ready.
IgtlBytes igtl_status(bool ready, const std::string& sentence);

}  // namespace palpate
