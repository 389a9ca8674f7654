#pragma once

#include <string>

namespace palpate {

/// What the name of a video stands for.
enum class SourceKind { file, device, pipeline, address };

/// By structure: "0" and "/dev/video0" are devices, "a ! b" is a GStreamer pipeline, "x://y" an address; all else is a
/// file.
SourceKind kind_of_source(const std::string& name);

}  // namespace palpate
