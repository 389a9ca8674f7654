#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

#include "palpate/elastic/element_packs.h"
#include "palpate/elastic/tet_model.h"

namespace palpate {

namespace {

using laws::Matrix3;
using laws::Matrix9;
using LaneVec3 = Eigen::Matrix<Simd, 3, 1>;
using Blocks = std::array<Matrix3<Simd>, 10>;        // pairs of nodes a >= b of an element
using VolumeGradient = Eigen::Matrix<double, 3, 4>;  // of an element with respect to its nodes, mm^2
using LaneGradients = std::array<LaneVec3, 4>;       // of the four shape functions, 1/mm

LaneGradients shape_gradients(const ElementPack& pack) {
  LaneGradients g;
  for (int a = 1; a < 4; ++a) g[static_cast<size_t>(a)] = pack.inverse_rest_edges.row(a - 1).transpose();
  g[0] = -(g[1] + g[2] + g[3]);
  return g;
}

/// Mean over the stars of the four nodes.
Simd pressure_of(const ElementPack& pack, const Eigen::VectorXd& patch_pressure) {
  Simd pressure;
  for (size_t lane = 0; lane < Simd::kCount; ++lane) {
    double sum = 0;
    for (size_t a = 0; a < 4; ++a) sum += patch_pressure[pack.first_value[a][lane] / 3];
    pressure.set(static_cast<int>(lane), sum / 4);
  }
  return pressure;
}

Mat9 positive_part(const Mat9& C) {
  const Eigen::SelfAdjointEigenSolver<Mat9> eigen(C);
  if (eigen.eigenvalues()[0] >= 0) return C;
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

void project_each(Matrix9<Simd>& C) {
  for (int lane = 0; lane < Simd::kCount; ++lane) {
    Mat9 of_lane;
    for (int k = 0; k < 81; ++k) of_lane.data()[k] = C.data()[k][lane];
    of_lane = positive_part(of_lane);
    for (int k = 0; k < 81; ++k) C.data()[k].set(lane, of_lane.data()[k]);
  }
}

/// K_ab = V sum_jl g_a[j] C(.j, .l) g_b[l]; dF_ij = du_ai g_aj.
Blocks stiffness_blocks(const Matrix9<Simd>& C, const LaneGradients& g, const Simd& volume) {
  Blocks blocks;
  for (size_t b = 0; b < 4; ++b) {
    const LaneVec3 scaled = volume * g[b];
    Eigen::Matrix<Simd, 9, 3> Cg;
    for (int i = 0; i < 9; ++i)
      for (int k = 0; k < 3; ++k) Cg(i, k) = C(i, k) * scaled[0] + C(i, 3 + k) * scaled[1] + C(i, 6 + k) * scaled[2];
    for (size_t a = b; a < 4; ++a)
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
          blocks[a * (a + 1) / 2 + b](i, k) = g[a][0] * Cg(i, k) + g[a][1] * Cg(3 + i, k) + g[a][2] * Cg(6 + i, k);
  }
  return blocks;
}

}  // namespace

Eigen::VectorXd TetModel::patch_pressure_MPa(const Eigen::VectorXd& u) const {
  Eigen::VectorXd pressure = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(patches_.size()));
  if (patches_.empty()) return pressure;
  std::vector<double> growth_mm3(tetrahedra_.size());  // of a quarter of each element
  laws::with_law(tissue_.law, [&](auto law) {
    run_batches(packs_->batches, [&](int begin, int end) {
      for (int p = begin; p < end; ++p) {
        const ElementPack& pack = packs_->packs[static_cast<size_t>(p)];
        const Simd growth =
            0.25 * pack.rest_volume_mm3 * (law.volume_ratio(palpate::deformation_gradient(pack, u.data())) - 1);
        for (int lane = 0; lane < Simd::kCount; ++lane)
          if (const int e = pack.element[static_cast<size_t>(lane)]; e >= 0)
            growth_mm3[static_cast<size_t>(e)] = growth[lane];
      }
    });
  });
  run_batches(*patch_batches_, [&](int begin, int end) {
    for (int s = begin; s < end; ++s) {
      const NodalPatch& patch = patches_[static_cast<size_t>(patch_batches_->order[static_cast<size_t>(s)])];
      double sum = 0;
      for (int e : patch.elements) sum += growth_mm3[static_cast<size_t>(e)];
      if (patch.volume_mm3 > 0) pressure[patch.node] = patch.bulk_MPa / patch.volume_mm3 * sum;
    }
  });
  return pressure;
}

double TetModel::energy(const Eigen::VectorXd& u) const {
  std::vector<double> of_pack(packs_->packs.size());
  laws::with_law(tissue_.law, [&](auto law) {
    run_batches(packs_->batches, [&](int begin, int end) {
      for (int p = begin; p < end; ++p) {
        const ElementPack& pack = packs_->packs[static_cast<size_t>(p)];
        const Simd density = law.energy_density(pack.lame, palpate::deformation_gradient(pack, u.data()));
        double sum = 0;
        for (int lane = 0; lane < Simd::kCount; ++lane)
          if (pack.element[static_cast<size_t>(lane)] >= 0) sum += pack.rest_volume_mm3[lane] * density[lane];
        of_pack[static_cast<size_t>(p)] = sum;
      }
    });
  });
  double total = 0;
  for (double energy : of_pack) total += energy;
  const Eigen::VectorXd pressure = patch_pressure_MPa(u);
  for (size_t n = 0; n < patches_.size(); ++n) {
    const double p = pressure[static_cast<Eigen::Index>(n)];
    if (patches_[n].bulk_MPa > 0) total += patches_[n].volume_mm3 * p * p / (2 * patches_[n].bulk_MPa);
  }
  return total;
}

template <class L>
void TetModel::add_element_forces(const Eigen::VectorXd& u, const Eigen::VectorXd& pressure,
                                  Eigen::VectorXd& force) const {
  run_batches(packs_->batches, [&](int begin, int end) {
    for (int p = begin; p < end; ++p) {
      const ElementPack& pack = packs_->packs[static_cast<size_t>(p)];
      const Matrix3<Simd> F = palpate::deformation_gradient(pack, u.data());
      Matrix3<Simd> P = L::first_piola_stress(pack.lame, F);
      if (!patches_.empty()) P += pressure_of(pack, pressure) * L::volume_ratio_gradient(F);
      // Columns: the forces on nodes 1 to 3; node 0 balances them.
      const Matrix3<Simd> H = pack.rest_volume_mm3 * P * pack.inverse_rest_edges.transpose();
      for (int i = 0; i < 3; ++i) {
        const Simd H0 = -(H(i, 0) + H(i, 1) + H(i, 2));
        for (size_t lane = 0; lane < Simd::kCount; ++lane) {
          const auto l = static_cast<int>(lane);
          force[pack.first_value[0][lane] + i] += H0[l];
          for (size_t a = 1; a < 4; ++a) force[pack.first_value[a][lane] + i] += H(i, static_cast<int>(a) - 1)[l];
        }
      }
    }
  });
}

Eigen::VectorXd TetModel::internal_force(const Eigen::VectorXd& u) const {
  Eigen::VectorXd force = Eigen::VectorXd::Zero(3 * node_count());
  const Eigen::VectorXd pressure = patch_pressure_MPa(u);
  laws::with_law(tissue_.law, [&](auto law) { add_element_forces<decltype(law)>(u, pressure, force); });
  return force;
}

template <class L>
void TetModel::add_element_tangents(const Eigen::VectorXd& u, const Eigen::VectorXd& pressure, bool project,
                                    double* values) const {
  run_batches(packs_->batches, [&](int begin, int end) {
    for (int p = begin; p < end; ++p) {
      const ElementPack& pack = packs_->packs[static_cast<size_t>(p)];
      const Matrix3<Simd> F = palpate::deformation_gradient(pack, u.data());
      Matrix9<Simd> C = L::stress_derivative(pack.lame, F);
      if (!patches_.empty()) C += pressure_of(pack, pressure) * L::volume_ratio_curvature(F);
      if (project) project_each(C);
      const Blocks blocks = stiffness_blocks(C, shape_gradients(pack), pack.rest_volume_mm3);
      for (int lane = 0; lane < Simd::kCount; ++lane) {
        const int e = pack.element[static_cast<size_t>(lane)];
        if (e < 0) continue;
        const Scatter& scatter = scatter_[static_cast<size_t>(e)];
        size_t pair = 0;
        for (int a = 0; a < 4; ++a)
          for (int b = 0; b <= a; ++b, ++pair) {
            if (scatter.start[pair][0] < 0) continue;
            const Matrix3<Simd>& block = blocks[pair];
            for (int c = 0; c < 3; ++c) {
              double* column = values + scatter.start[pair][static_cast<size_t>(c)];
              for (int r = a == b ? c : 0; r < 3; ++r)
                *column++ += scatter.turned[pair] ? block(c, r)[lane] : block(r, c)[lane];
            }
          }
      }
    }
  });
}

void TetModel::tangent(const Eigen::VectorXd& u, bool project, Eigen::SparseMatrix<double>& K) const {
  if (K.nonZeros() != pattern_.nonZeros()) K = pattern_;
  double* values = K.valuePtr();
  std::fill(values, values + K.nonZeros(), 0.0);
  const Eigen::VectorXd pressure = patch_pressure_MPa(u);
  laws::with_law(tissue_.law, [&](auto law) { add_element_tangents<decltype(law)>(u, pressure, project, values); });
  add_patch_tangents(u, values);
}

void TetModel::add_patch_tangents(const Eigen::VectorXd& u, double* values) const {
  if (patches_.empty()) return;
  std::vector<VolumeGradient> of_element(tetrahedra_.size());  // of a quarter of each
  laws::with_law(tissue_.law, [&](auto law) {
    run_batches(packs_->batches, [&](int begin, int end) {
      for (int p = begin; p < end; ++p) {
        const ElementPack& pack = packs_->packs[static_cast<size_t>(p)];
        const Matrix3<Simd> H = 0.25 * pack.rest_volume_mm3 *
                                law.volume_ratio_gradient(palpate::deformation_gradient(pack, u.data())) *
                                pack.inverse_rest_edges.transpose();
        for (int lane = 0; lane < Simd::kCount; ++lane) {
          const int e = pack.element[static_cast<size_t>(lane)];
          if (e < 0) continue;
          VolumeGradient& gradient = of_element[static_cast<size_t>(e)];
          for (int i = 0; i < 3; ++i)
            for (int a = 0; a < 3; ++a) gradient(i, a + 1) = H(i, a)[lane];
          gradient.col(0) = -(gradient.col(1) + gradient.col(2) + gradient.col(3));
        }
      }
    });
  });
  run_batches(*patch_batches_, [&](int begin, int end) {
    std::vector<Vec3> of_patch(rest_.size(), Vec3::Zero());
    for (int s = begin; s < end; ++s) {
      const NodalPatch& patch = patches_[static_cast<size_t>(patch_batches_->order[static_cast<size_t>(s)])];
      for (int e : patch.elements)
        for (int a = 0; a < 4; ++a)
          of_patch[static_cast<size_t>(tetrahedra_[static_cast<size_t>(e)][static_cast<size_t>(a)])] +=
              of_element[static_cast<size_t>(e)].col(a);
      auto block = patch.block_start.begin();
      for (auto column = patch.free_nodes.begin(); column != patch.free_nodes.end(); ++column) {
        const Vec3 scaled = patch.bulk_MPa / patch.volume_mm3 * of_patch[static_cast<size_t>(*column)];
        for (auto row = column; row != patch.free_nodes.end(); ++row)
          add_block(of_patch[static_cast<size_t>(*row)], scaled, *row == *column, first_unknown(*column), *block++,
                    values);
      }
      for (int e : patch.elements)
        for (int node : tetrahedra_[static_cast<size_t>(e)]) of_patch[static_cast<size_t>(node)].setZero();
    }
  });
}

void TetModel::add_block(const Vec3& row, const Vec3& column, bool diagonal, int first_column, int start,
                         double* values) const {
  for (int c = 0; c < 3; ++c) {
    for (int r = diagonal ? c : 0; r < 3; ++r) values[start + r] += row[r] * column[c];
    // The three columns of a node have the same rows, but each begins one lower, at its diagonal.
    const int* begin = pattern_.outerIndexPtr() + first_column + c;
    start += begin[1] - begin[0] - 1;
  }
}

}  // namespace palpate
