#include "palpate/estimate/force_estimate.h"

namespace palpate {

std::string status_name(FrameStatus status) {
  switch (status) {
    case FrameStatus::ok:
      return "ok";
    case FrameStatus::no_contact:
      return "no_contact";
    case FrameStatus::tool_lost:
      return "tool_lost";
    case FrameStatus::not_converged:
      return "not_converged";
    case FrameStatus::map_stale:
      return "map_stale";
  }
  return {};
}

}  // namespace palpate
