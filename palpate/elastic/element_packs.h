#pragma once

#include <array>
#include <vector>

#include "palpate/elastic/colored_batches.h"
#include "palpate/elastic/laws.h"

namespace palpate {

/// Eight tetrahedra of one tissue side by side.
struct ElementPack {
  laws::Matrix3<Simd> inverse_rest_edges;                    // D_m^-1
  Lame lame;                                                 // of what each element does by itself
  Simd rest_volume_mm3;                                      // 0 in the lanes beyond the last element
  std::array<std::array<int, Simd::kCount>, 4> first_value;  // of each node in a vector of displacements
  std::array<int, Simd::kCount> element;                     // number, -1 beyond the last element
};

/// All elements of a body; `batches.order` is that of the packs.
struct ElementPacks {
  std::vector<ElementPack> packs;
  ColoredBatches batches;
};

/// `order`: the elements in colored batches; every range begins with a pack of its own, and within it every tissue.
/// `tissue`: number of each element's constants among `lame`.
ElementPacks pack_elements(ColoredBatches order, const std::vector<Tetrahedron>& tetrahedra,
                           const std::vector<Mat3>& inverse_rest_edges, const std::vector<double>& rest_volume_mm3,
                           const std::vector<int>& tissue, const std::vector<Lame>& lame);

/// F = D_s D_m^-1.
inline laws::Matrix3<Simd> deformation_gradient(const ElementPack& pack, const double* u) {
  laws::Matrix3<Simd> edges;
  for (int i = 0; i < 3; ++i) {
    Simd u0;
    for (int lane = 0; lane < Simd::kCount; ++lane) u0.set(lane, u[pack.first_value[0][lane] + i]);
    for (int c = 0; c < 3; ++c) {
      Simd uc;
      for (int lane = 0; lane < Simd::kCount; ++lane)
        uc.set(lane, u[pack.first_value[static_cast<size_t>(c) + 1][lane] + i]);
      edges(i, c) = uc - u0;
    }
  }
  laws::Matrix3<Simd> F = edges * pack.inverse_rest_edges;
  for (int i = 0; i < 3; ++i) F(i, i) += 1;
  return F;
}

}  // namespace palpate
