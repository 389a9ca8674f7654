#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/elastic/material.h"

namespace palpate {

/// Rest state of a body of linear tetrahedra: what does not change while it deforms. Displacements u are 3 n vectors
/// (x y z of node 0, of node 1, ...), mm; forces likewise, N; stiffness N/mm.
class TetModel {
 public:
  TetModel(const TetMesh& mesh, const TissueOptions& tissue, const std::vector<int>& fixed_nodes);

  int node_count() const { return static_cast<int>(rest_.size()); }
  int element_count() const { return static_cast<int>(tetrahedra_.size()); }
  /// Unknowns: the degrees of freedom of the nodes that are not fixed.
  int unknown_count() const { return unknown_count_; }
  bool is_fixed(int node) const { return first_unknown_[static_cast<size_t>(node)] < 0; }
  /// Row of the node's x component among the unknowns, or -1 when it is fixed.
  int first_unknown(int node) const { return first_unknown_[static_cast<size_t>(node)]; }
  const std::vector<Vec3>& rest_mm() const { return rest_; }
  const std::vector<Tetrahedron>& tetrahedra() const { return tetrahedra_; }
  const TissueOptions& tissue() const { return tissue_; }
  double rest_volume_mm3(int element) const { return rest_volume_mm3_[static_cast<size_t>(element)]; }

  /// Deformation gradient F = D_s D_m^-1 of one element.
  Mat3 deformation_gradient(const Eigen::VectorXd& u, int element) const;

  /// Elastic energy of the whole body, N mm; infinite where a neo-Hookean element is inverted.
  double energy(const Eigen::VectorXd& u) const;

  /// Internal forces (gradient of the energy) on all nodes, N.
  Eigen::VectorXd internal_force(const Eigen::VectorXd& u) const;

  /// Tangent stiffness on the unknowns, lower triangle, on a pattern that never changes. With `project`, the element
  /// tangents are projected onto the positive semi-definite cone.
  void tangent(const Eigen::VectorXd& u, bool project, Eigen::SparseMatrix<double>& K) const;

  /// Smallest determinant of F over all elements.
  double smallest_volume_ratio(const Eigen::VectorXd& u) const;

  /// The entries of a full vector that belong to unknowns, and back (zero at fixed nodes).
  Eigen::VectorXd reduce(const Eigen::VectorXd& full) const;
  Eigen::VectorXd expand(const Eigen::VectorXd& reduced) const;

 private:
  void build_pattern();

  std::vector<Vec3> rest_;
  std::vector<Tetrahedron> tetrahedra_;
  TissueOptions tissue_;
  Lame lame_;
  std::vector<Mat3> inverse_rest_edges_;  // D_m^-1
  std::vector<double> rest_volume_mm3_;
  std::vector<int> first_unknown_;
  int unknown_count_ = 0;
  Eigen::SparseMatrix<double> pattern_;
  std::vector<std::array<int, 144>> scatter_;  // element entry -> value of K, -1 above the diagonal or fixed
};

}  // namespace palpate
