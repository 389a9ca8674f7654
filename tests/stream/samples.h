#pragma once

#include <functional>
#include <memory>

#include "palpate/stream/stream_frame.h"
#include "palpate/stream/stream_options.h"

namespace palpate::test {

/// A camera of 96x54 px that looks at one tetrahedron.
StreamScene small_scene();

/// A frame in contact: force (0.1, -0.2, 0.3) N at the tip (10, 20, 90) mm.
ForceEstimate touching(int frame = 7);
/// The same, and a second instrument that pulls by (0, 0, -0.5) N at (-5, 0, 80) mm.
ForceEstimate both_touching();
/// A frame in which nothing is seen.
ForceEstimate lost(int frame = 8);

std::shared_ptr<StreamFrame> frame_of(const ForceEstimate& estimate);

/// On some port that is free now.
OpenIgtLinkOptions on_free_port();

/// Until it holds, or for ten seconds; whether it holds.
bool soon(const std::function<bool()>& holds);

}  // namespace palpate::test
