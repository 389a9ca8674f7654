#include "palpate/elastic/tet_model.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <stdexcept>

namespace palpate {

namespace {

using Gradients = Eigen::Matrix<double, 4, 3>;  // of the four shape functions, 1/mm
using Mat12 = Eigen::Matrix<double, 12, 12>;

Gradients shape_gradients(const Mat3& inverse_rest_edges) {
  Gradients g;
  g.bottomRows<3>() = inverse_rest_edges;
  g.row(0) = -(g.row(1) + g.row(2) + g.row(3));
  return g;
}

Mat9 positive_part(const Mat9& C) {
  const Eigen::SelfAdjointEigenSolver<Mat9> eigen(C);
  if (eigen.eigenvalues()[0] >= 0) return C;
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

Mat12 element_stiffness(const Mat9& C, const Gradients& g, double volume) {
  // B (9 x 12) maps nodal displacements to vec(F): dF_ij = du_ai g_aj.
  Eigen::Matrix<double, 9, 12> CB;
  for (int a = 0; a < 4; ++a)
    CB.block<9, 3>(0, 3 * a) =
        g(a, 0) * C.block<9, 3>(0, 0) + g(a, 1) * C.block<9, 3>(0, 3) + g(a, 2) * C.block<9, 3>(0, 6);
  Mat12 K;
  for (int a = 0; a < 4; ++a)
    K.block<3, 12>(3 * a, 0) =
        volume * (g(a, 0) * CB.block<3, 12>(0, 0) + g(a, 1) * CB.block<3, 12>(3, 0) + g(a, 2) * CB.block<3, 12>(6, 0));
  return K;
}

}  // namespace

TetModel::TetModel(const TetMesh& mesh, const TissueOptions& tissue, const std::vector<int>& fixed_nodes,
                   Element element)
    : rest_(mesh.nodes_mm), tetrahedra_(mesh.tetrahedra), tissue_(tissue), lame_(lame_of(tissue)) {
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
  if (element == Element::averaged) build_stars();
  build_pattern();
}

void TetModel::build_stars() {
  star_bulk_MPa_ = bulk_modulus(lame_);
  lame_ = without_bulk(lame_);
  stars_.resize(rest_.size());
  for (size_t e = 0; e < tetrahedra_.size(); ++e)
    for (int node : tetrahedra_[e]) stars_[static_cast<size_t>(node)].elements.push_back(static_cast<int>(e));
  for (Star& star : stars_) {
    for (int e : star.elements) {
      star.volume_mm3 += rest_volume_mm3_[static_cast<size_t>(e)] / 4;
      for (int node : tetrahedra_[static_cast<size_t>(e)])
        if (!is_fixed(node)) star.free_nodes.push_back(node);
    }
    std::sort(star.free_nodes.begin(), star.free_nodes.end());
    star.free_nodes.erase(std::unique(star.free_nodes.begin(), star.free_nodes.end()), star.free_nodes.end());
  }
}

void TetModel::build_pattern() {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(tetrahedra_.size() * 78);
  const auto unknowns_of = [this](const Tetrahedron& t) {
    std::array<int, 12> unknowns;
    for (size_t a = 0; a < 4; ++a) {
      const int first = first_unknown_[static_cast<size_t>(t[a])];
      for (size_t i = 0; i < 3; ++i) unknowns[3 * a + i] = first < 0 ? -1 : first + static_cast<int>(i);
    }
    return unknowns;
  };
  for (const Tetrahedron& t : tetrahedra_) {
    const auto unknowns = unknowns_of(t);
    for (int column : unknowns)
      for (int row : unknowns)
        if (column >= 0 && row >= column) entries.emplace_back(row, column, 0.0);
  }
  for (const Star& star : stars_)
    for (int column : star.free_nodes)
      for (int row : star.free_nodes)
        for (int c = 0; c < 3 && row >= column; ++c)
          for (int r = row == column ? c : 0; r < 3; ++r)
            entries.emplace_back(first_unknown(row) + r, first_unknown(column) + c, 0.0);
  pattern_.resize(unknown_count_, unknown_count_);
  pattern_.setFromTriplets(entries.begin(), entries.end());
  pattern_.makeCompressed();

  const auto position = [this](int row, int column) {
    const int* begin = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[column];
    const int* end = pattern_.innerIndexPtr() + pattern_.outerIndexPtr()[column + 1];
    return static_cast<int>(std::lower_bound(begin, end, row) - pattern_.innerIndexPtr());
  };
  for (Star& star : stars_)
    for (auto column = star.free_nodes.begin(); column != star.free_nodes.end(); ++column)
      for (auto row = column; row != star.free_nodes.end(); ++row)
        star.block_start.push_back(position(first_unknown(*row), first_unknown(*column)));
  scatter_.resize(tetrahedra_.size());
  for (size_t e = 0; e < tetrahedra_.size(); ++e) {
    const auto unknowns = unknowns_of(tetrahedra_[e]);
    for (size_t c = 0; c < 12; ++c)
      for (size_t r = 0; r < 12; ++r) {
        const int row = unknowns[r], column = unknowns[c];
        int& target = scatter_[e][12 * c + r];
        target = -1;
        if (column < 0 || row < column) continue;
        target = position(row, column);
      }
  }
}

Mat3 TetModel::deformation_gradient(const Eigen::VectorXd& u, int element) const {
  const Tetrahedron& t = tetrahedra_[static_cast<size_t>(element)];
  const Vec3 u0 = u.segment<3>(3 * t[0]);
  Mat3 edges_of_u;
  for (int c = 0; c < 3; ++c) edges_of_u.col(c) = u.segment<3>(3 * t[static_cast<size_t>(c) + 1]) - u0;
  return Mat3::Identity() + edges_of_u * inverse_rest_edges_[static_cast<size_t>(element)];
}

Eigen::VectorXd TetModel::star_pressure_MPa(const Eigen::VectorXd& u) const {
  Eigen::VectorXd pressure = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(stars_.size()));
  if (stars_.empty()) return pressure;
  for (size_t e = 0; e < tetrahedra_.size(); ++e) {
    const Mat3 F = deformation_gradient(u, static_cast<int>(e));
    const double growth_mm3 = rest_volume_mm3_[e] / 4 * (volume_ratio(tissue_.law, F) - 1);
    for (int node : tetrahedra_[e]) pressure[node] += growth_mm3;
  }
  for (size_t n = 0; n < stars_.size(); ++n)
    if (stars_[n].volume_mm3 > 0) pressure[static_cast<Eigen::Index>(n)] *= star_bulk_MPa_ / stars_[n].volume_mm3;
  return pressure;
}

double TetModel::element_pressure_MPa(const Eigen::VectorXd& star_pressure_MPa, size_t element) const {
  double sum = 0;
  for (int node : tetrahedra_[element]) sum += star_pressure_MPa[node];
  return sum / 4;
}

double TetModel::energy(const Eigen::VectorXd& u) const {
  double total = 0;
  for (int e = 0; e < element_count(); ++e)
    total += rest_volume_mm3_[static_cast<size_t>(e)] * energy_density(tissue_.law, lame_, deformation_gradient(u, e));
  const Eigen::VectorXd pressure = star_pressure_MPa(u);
  for (size_t n = 0; n < stars_.size(); ++n) {
    const double p = pressure[static_cast<Eigen::Index>(n)];
    total += stars_[n].volume_mm3 * p * p / (2 * star_bulk_MPa_);
  }
  return total;
}

Eigen::VectorXd TetModel::internal_force(const Eigen::VectorXd& u) const {
  Eigen::VectorXd force = Eigen::VectorXd::Zero(3 * node_count());
  const Eigen::VectorXd pressure = star_pressure_MPa(u);
  for (int e = 0; e < element_count(); ++e) {
    const size_t i = static_cast<size_t>(e);
    const Mat3 F = deformation_gradient(u, e);
    Mat3 P = first_piola_stress(tissue_.law, lame_, F);
    if (!stars_.empty()) P += element_pressure_MPa(pressure, i) * volume_ratio_gradient(tissue_.law, F);
    const Gradients g = shape_gradients(inverse_rest_edges_[i]);
    for (int a = 0; a < 4; ++a)
      force.segment<3>(3 * tetrahedra_[i][static_cast<size_t>(a)]) += rest_volume_mm3_[i] * P * g.row(a).transpose();
  }
  return force;
}

void TetModel::tangent(const Eigen::VectorXd& u, bool project, Eigen::SparseMatrix<double>& K) const {
  if (K.nonZeros() != pattern_.nonZeros()) K = pattern_;
  double* values = K.valuePtr();
  std::fill(values, values + K.nonZeros(), 0.0);
  const Eigen::VectorXd pressure = star_pressure_MPa(u);
  for (int e = 0; e < element_count(); ++e) {
    const size_t i = static_cast<size_t>(e);
    const Mat3 F = deformation_gradient(u, e);
    Mat9 C = stress_derivative(tissue_.law, lame_, F);
    if (!stars_.empty()) C += element_pressure_MPa(pressure, i) * volume_ratio_curvature(tissue_.law, F);
    if (project) C = positive_part(C);
    const Mat12 Ke = element_stiffness(C, shape_gradients(inverse_rest_edges_[i]), rest_volume_mm3_[i]);
    const std::array<int, 144>& scatter = scatter_[i];
    const double* entry = Ke.data();
    for (size_t k = 0; k < 144; ++k)
      if (scatter[k] >= 0) values[scatter[k]] += entry[k];
  }
  add_star_tangents(u, values);
}

void TetModel::add_star_tangents(const Eigen::VectorXd& u, double* values) const {
  if (stars_.empty()) return;
  using VolumeGradient = Eigen::Matrix<double, 3, 4>;  // of a quarter of the element with respect to its nodes, mm^2
  std::vector<VolumeGradient> of_element(tetrahedra_.size());
  for (size_t e = 0; e < tetrahedra_.size(); ++e)
    of_element[e] = rest_volume_mm3_[e] / 4 *
                    volume_ratio_gradient(tissue_.law, deformation_gradient(u, static_cast<int>(e))) *
                    shape_gradients(inverse_rest_edges_[e]).transpose();
  std::vector<Vec3> of_star(rest_.size(), Vec3::Zero());
  for (const Star& star : stars_) {
    for (int e : star.elements)
      for (int a = 0; a < 4; ++a)
        of_star[static_cast<size_t>(tetrahedra_[static_cast<size_t>(e)][static_cast<size_t>(a)])] +=
            of_element[static_cast<size_t>(e)].col(a);
    auto block = star.block_start.begin();
    for (auto column = star.free_nodes.begin(); column != star.free_nodes.end(); ++column) {
      const Vec3 scaled = star_bulk_MPa_ / star.volume_mm3 * of_star[static_cast<size_t>(*column)];
      for (auto row = column; row != star.free_nodes.end(); ++row)
        add_block(of_star[static_cast<size_t>(*row)], scaled, *row == *column, first_unknown(*column), *block++,
                  values);
    }
    for (int e : star.elements)
      for (int node : tetrahedra_[static_cast<size_t>(e)]) of_star[static_cast<size_t>(node)].setZero();
  }
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
  Eigen::VectorXd full = Eigen::VectorXd::Zero(3 * node_count());
  for (size_t n = 0; n < first_unknown_.size(); ++n)
    if (first_unknown_[n] >= 0)
      full.segment<3>(3 * static_cast<Eigen::Index>(n)) = reduced.segment<3>(first_unknown_[n]);
  return full;
}

}  // namespace palpate
