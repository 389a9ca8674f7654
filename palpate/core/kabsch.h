#pragma once

#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

/// The rotation R for which the sum of |to - R from|^2 over all pairs is least (Kabsch 1976). Where the vectors lie
/// along a line, any rotation about it is as good.
Mat3 rotation_onto(const std::vector<Vec3>& from, const std::vector<Vec3>& to);

}  // namespace palpate
