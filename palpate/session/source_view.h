#pragma once

#include <string>

#include "palpate/session/snapshot.h"

namespace palpate {

/// The recording of a scene at one of its frames (the last one, where it has fewer), of a live one at the first with
/// pictures. Throws BadInput that names the scene file and the key.
SourceView view_source(const SceneFile& scene, Recording& recording, int frame);

/// What of a scene its source hangs on, to tell whether it has to be opened again.
std::string recording_text(const SceneFile& scene);

}  // namespace palpate
