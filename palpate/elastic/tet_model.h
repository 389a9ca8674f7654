#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <memory>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/elastic/material.h"

namespace palpate {

struct ElementPacks;
struct ColoredBatches;

/// How the energy of a change of volume is measured. Linear tetrahedra with a volume ratio each of their own lock in
/// nearly incompressible tissue and overstate the force. Averaged over the elements around each node (energy-based, so
/// the tangent stays symmetric, but couples nodes two edges apart), it no longer does.
enum class Element { linear, averaged };

/// Rest state of a body of linear tetrahedra: what does not change while it deforms. Displacements u are 3 n vectors
/// (x y z of node 0, of node 1, ...), mm; forces likewise, N; stiffness N/mm.
class TetModel {
 public:
  TetModel(const TetMesh& mesh, const TissueOptions& tissue, const std::vector<int>& fixed_nodes,
           Element element = Element::linear);

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
  /// Constants of one element, by its label.
  Lame lame(int element) const { return lame_of(tissue_, label_[static_cast<size_t>(element)]); }
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
  /// Whether the law is in its valid range in every element.
  bool in_valid_range(const Eigen::VectorXd& u) const;

  /// The entries of a full vector that belong to unknowns, and the displacement of all nodes that unknowns stand for:
  /// they count from the base, which is zero unless set.
  Eigen::VectorXd reduce(const Eigen::VectorXd& full) const;
  Eigen::VectorXd expand(const Eigen::VectorXd& reduced) const;
  /// A displacement of all nodes, 3 n, mm, that unknowns count from; it is where fixed nodes are.
  void set_base(const Eigen::VectorXd& u) { base_ = u; }

 private:
  /// The elements around one node, a quarter of each: they share one volume ratio.
  struct NodalPatch {
    int node = 0;
    double volume_mm3 = 0;
    double bulk_MPa = 0;  // mean over the volume
    std::vector<int> elements;
    std::vector<int> free_nodes;   // ascending
    std::vector<int> block_start;  // for each pair of them, columns first: the first entry of their block in K
  };
  /// Where the 3 x 3 blocks of an element go: for each pair of its nodes (rows a >= columns b) the first entry of the
  /// three columns in K, -1 where a node is fixed. In K, the later unknown has the row: `turned` blocks go in
  /// transposed.
  struct Scatter {
    std::array<std::array<int, 3>, 10> start;
    std::array<bool, 10> turned;
  };

  void build_patches();
  void build_pattern();
  void build_order();
  int position(int row, int column) const;
  /// kappa (theta - 1) of every nodal patch, MPa; empty for Element::linear.
  Eigen::VectorXd patch_pressure_MPa(const Eigen::VectorXd& u) const;
  template <class L>
  void add_element_forces(const Eigen::VectorXd& u, const Eigen::VectorXd& pressure, Eigen::VectorXd& force) const;
  template <class L>
  void add_element_tangents(const Eigen::VectorXd& u, const Eigen::VectorXd& pressure, bool project,
                            double* values) const;
  void add_patch_tangents(const Eigen::VectorXd& u, double* values) const;
  void add_block(const Vec3& row, const Vec3& column, bool diagonal, int first_column, int start, double* values) const;

  std::vector<Vec3> rest_;
  std::vector<Tetrahedron> tetrahedra_;
  TissueOptions tissue_;
  std::vector<int> label_;                // of each element, 0 to the number of labels that the tissue knows
  std::vector<NodalPatch> patches_;       // one per node; empty for Element::linear
  std::vector<Mat3> inverse_rest_edges_;  // D_m^-1
  std::vector<double> rest_volume_mm3_;
  std::vector<int> first_unknown_;
  int unknown_count_ = 0;
  Eigen::VectorXd base_;  // empty = zero
  Eigen::SparseMatrix<double> pattern_;
  std::vector<Scatter> scatter_;               // one per element
  std::shared_ptr<const ElementPacks> packs_;  // what the loops over elements run on
  std::shared_ptr<const ColoredBatches> patch_batches_;
};

}  // namespace palpate
