#pragma once

#include <array>
#include <vector>

#include "palpate/elastic/laws.h"
#include "palpate/elastic/phases.h"

namespace palpate {

/// Eight tetrahedra of one tissue side by side.
struct ElementPack {
  laws::Matrix3<Lanes> inverse_rest_edges;                    // D_m^-1
  Lame lame;                                                  // of what each element does by itself
  Lanes rest_volume_mm3;                                      // 0 in the lanes beyond the last element
  std::array<std::array<int, Lanes::kCount>, 4> first_value;  // of each node in a vector of displacements
  std::array<int, Lanes::kCount> element;                     // number, -1 beyond the last element
};

/// All elements of a body; `phases.order` is that of the packs.
struct ElementPacks {
  std::vector<ElementPack> packs;
  Phases phases;
};

/// `order`: the elements in phases; every range begins with a pack of its own, and within it every tissue. `tissue`:
/// number of each element's constants among `lame`.
ElementPacks pack_elements(Phases order, const std::vector<Tetrahedron>& tetrahedra,
                           const std::vector<Mat3>& inverse_rest_edges, const std::vector<double>& rest_volume_mm3,
                           const std::vector<int>& tissue, const std::vector<Lame>& lame);

/// F = D_s D_m^-1.
inline laws::Matrix3<Lanes> deformation_gradient(const ElementPack& pack, const double* u) {
  laws::Matrix3<Lanes> edges;
  for (int i = 0; i < 3; ++i) {
    Lanes u0;
    for (int lane = 0; lane < Lanes::kCount; ++lane) u0.set(lane, u[pack.first_value[0][lane] + i]);
    for (int c = 0; c < 3; ++c) {
      Lanes uc;
      for (int lane = 0; lane < Lanes::kCount; ++lane)
        uc.set(lane, u[pack.first_value[static_cast<size_t>(c) + 1][lane] + i]);
      edges(i, c) = uc - u0;
    }
  }
  laws::Matrix3<Lanes> F = edges * pack.inverse_rest_edges;
  for (int i = 0; i < 3; ++i) F(i, i) += 1;
  return F;
}

}  // namespace palpate
