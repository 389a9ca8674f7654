#include "palpate/elastic/tet_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "palpate/elastic/element_packs.h"

namespace palpate {

namespace {

/// Below this many elements a slab is not worth a thread of its own.
constexpr int kElementsPerSlab = 2500, kMaxSlabs = 8;

/// Slab of every node along the longest side of the body, about equally many nodes each.
std::vector<int> slabs_of_nodes(const std::vector<Vec3>& nodes, int slabs) {
  Vec3 min = nodes.front(), max = min;
  for (const Vec3& node : nodes) min = min.cwiseMin(node), max = max.cwiseMax(node);
  Eigen::Index axis = 0;
  (max - min).maxCoeff(&axis);
  std::vector<size_t> order(nodes.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return nodes[a][axis] < nodes[b][axis]; });
  std::vector<int> slab(nodes.size());
  for (size_t i = 0; i < order.size(); ++i)
    slab[order[i]] = static_cast<int>(i * static_cast<size_t>(slabs) / order.size());
  return slab;
}

}  // namespace

TetModel::TetModel(const TetMesh& mesh, const TissueOptions& tissue, const std::vector<int>& fixed_nodes,
                   Element element)
    : rest_(mesh.nodes_mm), tetrahedra_(mesh.tetrahedra), tissue_(tissue), label_(mesh.tetrahedra.size(), 0) {
  for (size_t e = 0; e < std::min(label_.size(), mesh.label.size()); ++e)
    if (mesh.label[e] > 0 && mesh.label[e] <= static_cast<int>(tissue.of_label.size())) label_[e] = mesh.label[e];
  inverse_rest_edges_.reserve(tetrahedra_.size());
  rest_volume_mm3_.reserve(tetrahedra_.size());
  for (const Tetrahedron& t : tetrahedra_) {
    Mat3 D_m;
    for (int c = 0; c < 3; ++c)
      D_m.col(c) = rest_[static_cast<size_t>(t[static_cast<size_t>(c) + 1])] - rest_[static_cast<size_t>(t[0])];
    const double volume = D_m.determinant() / 6;
    if (!(volume > 0)) throw std::invalid_argument("TetModel: a tetrahedron has no positive volume");
    inverse_rest_edges_.push_back(D_m.inverse());
    rest_volume_mm3_.push_back(volume);
  }
  first_unknown_.assign(rest_.size(), 0);
  for (int node : fixed_nodes) first_unknown_[static_cast<size_t>(node)] = -1;
  for (int& first : first_unknown_) {
    if (first < 0) continue;
    first = unknown_count_;
    unknown_count_ += 3;
  }
  if (element == Element::averaged) build_patches();
  build_pattern();
  build_order();
}

void TetModel::build_patches() {
  patches_.resize(rest_.size());
  for (size_t e = 0; e < tetrahedra_.size(); ++e)
    for (int node : tetrahedra_[e]) patches_[static_cast<size_t>(node)].elements.push_back(static_cast<int>(e));
  for (NodalPatch& patch : patches_) {
    patch.node = static_cast<int>(&patch - patches_.data());
    for (int e : patch.elements) {
      const double quarter_mm3 = rest_volume_mm3_[static_cast<size_t>(e)] / 4;
      patch.bulk_MPa =
          (patch.volume_mm3 * patch.bulk_MPa + quarter_mm3 * bulk_modulus(lame(e))) / (patch.volume_mm3 + quarter_mm3);
      patch.volume_mm3 += quarter_mm3;
      for (int node : tetrahedra_[static_cast<size_t>(e)])
        if (!is_fixed(node)) patch.free_nodes.push_back(node);
    }
    std::sort(patch.free_nodes.begin(), patch.free_nodes.end());
    patch.free_nodes.erase(std::unique(patch.free_nodes.begin(), patch.free_nodes.end()), patch.free_nodes.end());
  }
}

int TetModel::position(int row, int column) const {
  const int* begin = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[column];
  const int* end = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[column + 1];
  return static_cast<int>(std::lower_bound(begin, end, row) - pattern_.innerIndexPtr());
}

void TetModel::build_pattern() {
  // Nodes below each node in the lower triangle, then three rows and columns for each.
  std::vector<std::vector<int>> below(rest_.size());
  const auto couple = [this, &below](int a, int b) {
    if (is_fixed(a) || is_fixed(b) || b < a) return;
    below[static_cast<size_t>(a)].push_back(b);
  };
  if (patches_.empty()) {
    for (const Tetrahedron& t : tetrahedra_)
      for (int a : t)
        for (int b : t) couple(a, b);
  }
  for (const NodalPatch& patch : patches_)
    for (int a : patch.free_nodes)
      for (int b : patch.free_nodes) couple(a, b);
  Eigen::VectorXi entries_of_column = Eigen::VectorXi::Zero(unknown_count_);
  for (size_t a = 0; a < below.size(); ++a) {
    std::sort(below[a].begin(), below[a].end());
    below[a].erase(std::unique(below[a].begin(), below[a].end()), below[a].end());
    for (int c = 0; c < 3 && first_unknown_[a] >= 0; ++c)
      entries_of_column[first_unknown_[a] + c] = 3 * static_cast<int>(below[a].size());
  }
  pattern_.resize(unknown_count_, unknown_count_);
  pattern_.reserve(entries_of_column);
  for (size_t a = 0; a < below.size(); ++a)
    for (int c = 0; c < 3 && first_unknown_[a] >= 0; ++c)
      for (int b : below[a])
        for (int r = b == static_cast<int>(a) ? c : 0; r < 3; ++r)
          pattern_.insert(first_unknown(b) + r, first_unknown_[a] + c) = 0;
  pattern_.makeCompressed();

  for (NodalPatch& patch : patches_)
    for (auto column = patch.free_nodes.begin(); column != patch.free_nodes.end(); ++column)
      for (auto row = column; row != patch.free_nodes.end(); ++row)
        patch.block_start.push_back(position(first_unknown(*row), first_unknown(*column)));
  scatter_.resize(tetrahedra_.size());
  for (size_t e = 0; e < tetrahedra_.size(); ++e) {
    size_t pair = 0;
    for (size_t a = 0; a < 4; ++a)
      for (size_t b = 0; b <= a; ++b, ++pair) {
        const int first_a = first_unknown(tetrahedra_[e][a]), first_b = first_unknown(tetrahedra_[e][b]);
        const int row = std::max(first_a, first_b), column = std::min(first_a, first_b);
        scatter_[e].turned[pair] = first_a < first_b;
        for (int c = 0; c < 3; ++c)
          scatter_[e].start[pair][static_cast<size_t>(c)] =
              column < 0 ? -1 : position(a == b ? row + c : row, column + c);
      }
  }
}

void TetModel::build_order() {
  const int slabs = std::clamp(element_count() / kElementsPerSlab, 1, kMaxSlabs);
  const std::vector<int> slab_of_node = slabs_of_nodes(rest_, slabs);
  std::vector<int> min, max;
  const auto add_item = [&](const auto& nodes) {
    int low = slabs, high = 0;
    for (int node : nodes) {
      low = std::min(low, slab_of_node[static_cast<size_t>(node)]);
      high = std::max(high, slab_of_node[static_cast<size_t>(node)]);
    }
    min.push_back(std::min(low, high));
    max.push_back(high);
  };
  for (const Tetrahedron& t : tetrahedra_) add_item(t);
  std::vector<Lame> of_label;
  for (int label = 0; label <= static_cast<int>(tissue_.of_label.size()); ++label)
    of_label.push_back(patches_.empty() ? lame_of(tissue_, label) : without_bulk(lame_of(tissue_, label)));
  packs_ = std::make_shared<ElementPacks>(pack_elements(color_batches(min, max, slabs), tetrahedra_,
                                                        inverse_rest_edges_, rest_volume_mm3_, label_, of_label));
  min.clear();
  max.clear();
  for (const NodalPatch& patch : patches_) add_item(patch.free_nodes);
  patch_batches_ = std::make_shared<ColoredBatches>(color_batches(min, max, slabs));
}

Mat3 TetModel::deformation_gradient(const Eigen::VectorXd& u, int element) const {
  const Tetrahedron& t = tetrahedra_[static_cast<size_t>(element)];
  const Vec3 u0 = u.segment<3>(3 * t[0]);
  Mat3 edges_of_u;
  for (int c = 0; c < 3; ++c) edges_of_u.col(c) = u.segment<3>(3 * t[static_cast<size_t>(c) + 1]) - u0;
  return Mat3::Identity() + edges_of_u * inverse_rest_edges_[static_cast<size_t>(element)];
}

double TetModel::smallest_volume_ratio(const Eigen::VectorXd& u) const {
  double smallest = 1;
  for (int e = 0; e < element_count(); ++e) smallest = std::min(smallest, deformation_gradient(u, e).determinant());
  return smallest;
}

bool TetModel::in_valid_range(const Eigen::VectorXd& u) const {
  for (int e = 0; e < element_count(); ++e)
    if (!palpate::in_valid_range(tissue_.law, deformation_gradient(u, e))) return false;
  return true;
}

Eigen::VectorXd TetModel::reduce(const Eigen::VectorXd& full) const {
  Eigen::VectorXd reduced(unknown_count_);
  for (size_t n = 0; n < first_unknown_.size(); ++n)
    if (first_unknown_[n] >= 0)
      reduced.segment<3>(first_unknown_[n]) = full.segment<3>(3 * static_cast<Eigen::Index>(n));
  return reduced;
}

Eigen::VectorXd TetModel::expand(const Eigen::VectorXd& reduced) const {
  Eigen::VectorXd full = base_.size() > 0 ? base_ : Eigen::VectorXd::Zero(3 * node_count());
  for (size_t n = 0; n < first_unknown_.size(); ++n)
    if (first_unknown_[n] >= 0)
      full.segment<3>(3 * static_cast<Eigen::Index>(n)) += reduced.segment<3>(first_unknown_[n]);
  return full;
}

}  // namespace palpate
