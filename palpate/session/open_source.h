#pragma once

#include <memory>
#include <string>

#include "palpate/session/snapshot.h"

namespace palpate {

/// The recording of a scene at one of its frames (the last one, where it has fewer). Throws BadInput that names the
/// scene file and the key.
std::shared_ptr<const SourceView> open_source(const SceneFile& scene, int frame);

/// What of a scene its source hangs on, to tell whether it has to be opened again.
std::string recording_text(const SceneFile& scene);

}  // namespace palpate
