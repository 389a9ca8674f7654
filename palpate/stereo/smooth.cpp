#include <tbb/parallel_for.h>

#include <cmath>

#include "palpate/stereo/refine.h"

namespace palpate {
namespace {

constexpr float kSameSurface_px = 0.2f;
constexpr float kGateDeviations = 3;
constexpr float kMinAgreement = 0.3f;   // of the neighbours, by weight
constexpr float kMinNeighbours = 4.0f;  // by weight
constexpr int kMargin = 16;             // cells, more than any reach
constexpr int kNear = 5;                // cells that have to agree
// A pixel counts in as many windows of refinement as cells stand in one.
constexpr float kWindowsPerPixel = 11;
constexpr float kMinScatter = 0.25f;

// The grid as planes of numbers with a margin without information, so that sixteen cells are worked on at once.
class Planes {
 public:
  explicit Planes(const CellGrid& grid) : stride_(grid.columns + 2 * kMargin + kLanes) {
    const size_t count = static_cast<size_t>(stride_ * (grid.rows + 2 * kMargin));
    for (std::vector<float>* plane : {&d, &dx, &dy, &information, &gate}) plane->assign(count, 0);
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) {
        const Cell& cell = grid.at(column, row);
        if (!cell.matched) continue;
        const size_t at = index(column, row);
        d[at] = cell.plane.d, dx[at] = cell.plane.dx, dy[at] = cell.plane.dy;
        information[at] = cell.information;
        gate[at] = kSameSurface_px + kGateDeviations / std::sqrt(cell.information);
      }
  }
  size_t index(int column, int row) const { return static_cast<size_t>((row + kMargin) * stride_ + column + kMargin); }

  std::vector<float> d, dx, dy, information, gate;

 private:
  int stride_;
};

constexpr int kTerms = 6;  // 1, u, v, u^2 / 2, u v, v^2 / 2
constexpr int kProducts = kTerms * (kTerms + 1) / 2;

struct Neighbour {
  int column, row;
  float u, v;  // px
  float falloff;
  bool near;  // one of those that have to agree
  float basis[kTerms];
};

std::vector<Neighbour> neighbourhood(Reach reach) {
  std::vector<Neighbour> all;
  const int whole = reach.radius - reach.radius % reach.step;
  for (int j = -whole; j <= whole; j += reach.step)
    for (int i = -whole; i <= whole; i += reach.step) {
      const int squares = i * i + j * j;
      const float distance = static_cast<float>(squares) / static_cast<float>((reach.radius + 1) * (reach.radius + 1));
      if (distance >= 1) continue;
      const float u = static_cast<float>(i * CellGrid::kStep_px), v = static_cast<float>(j * CellGrid::kStep_px);
      all.push_back({i,
                     j,
                     u,
                     v,
                     (1 - distance) * (1 - distance),
                     squares <= kNear * kNear,
                     {1, u, v, 0.5f * u * u, u * v, 0.5f * v * v}});
    }
  return all;
}

constexpr int at(int row, int column) {
  return row * (row + 1) / 2 + column;
}

// Cholesky of sixteen matrices at once, lower triangles row by row; the inverse of the diagonal is kept.
void factorise(FloatLanes (&A)[kProducts]) {
  for (int k = 0; k < kTerms; ++k)
    for (int m = 0; m <= k; ++m) {
      FloatLanes sum = A[at(k, m)];
      for (int i = 0; i < m; ++i) sum -= A[at(k, i)] * A[at(m, i)];
      if (m < k)
        A[at(k, m)] = sum * A[at(m, m)];
      else
        for (int lane = 0; lane < kLanes; ++lane) A[at(k, k)][lane] = 1 / std::sqrt(std::max(sum[lane], 1e-20f));
    }
}

void solve_lower(const FloatLanes (&L)[kProducts], FloatLanes (&b)[kTerms]) {
  for (int k = 0; k < kTerms; ++k) {
    for (int i = 0; i < k; ++i) b[k] -= L[at(k, i)] * b[i];
    b[k] *= L[at(k, k)];
  }
}

// The right-hand sides become the answers.
void solve(const FloatLanes (&L)[kProducts], FloatLanes (&b)[kTerms]) {
  solve_lower(L, b);
  for (int k = kTerms - 1; k >= 0; --k) {
    for (int i = k + 1; i < kTerms; ++i) b[k] -= L[at(i, k)] * b[i];
    b[k] *= L[at(k, k)];
  }
}

FloatLanes corner_of_inverse(const FloatLanes (&L)[kProducts]) {
  FloatLanes column[kTerms] = {all_of_simd(1)}, sum = {};
  solve_lower(L, column);
  for (const FloatLanes& value : column) sum += value * value;
  return sum;
}

// Quadratics through the neighbours of sixteen cells on the same surface, as changes of the cells' own planes.
struct Quadratics {
  FloatLanes change[kTerms] = {};
  FloatLanes variance = {};            // of the first of them, if the cells scattered as they say
  FloatLanes scatter = {};             // how much more their squares scatter about the quadratic
  FloatLanes agreeing = {}, all = {};  // neighbours near by, by weight
};

Quadratics fit_quadratics(const Planes& planes, const std::vector<Neighbour>& around, int column, int row) {
  const size_t here = planes.index(column, row);
  const FloatLanes d = load_lanes(&planes.d[here]), dx = load_lanes(&planes.dx[here]),
                   dy = load_lanes(&planes.dy[here]);
  FloatLanes products[kProducts] = {}, squares = {}, weights = {}, sums[kTerms];
  Quadratics result;
  for (const Neighbour& n : around) {
    const size_t there = planes.index(column + n.column, row + n.row);
    const FloatLanes information = load_lanes(&planes.information[there]);
    const FloatLanes rise = load_lanes(&planes.d[there]) - d;
    const FloatLanes off = rise - (dx * n.u + dy * n.v);
    // On a quadratic, the mean of both slopes leads from one cell to the other.
    const FloatLanes apart =
        rise - 0.5f * ((dx + load_lanes(&planes.dx[there])) * n.u + (dy + load_lanes(&planes.dy[there])) * n.v);
    const FloatLanes gate = load_lanes(&planes.gate[there]);
    const FloatLanes nothing = {};
    const FloatLanes known = information > nothing ? all_of_simd(n.falloff) : nothing;
    const FloatLanes agrees = apart <= gate ? (apart >= -gate ? known : nothing) : nothing;
    if (n.near) {
      result.all += known;
      result.agreeing += agrees;
    }
    const FloatLanes weight = information * agrees, weighted_off = weight * off;
    squares += weighted_off * off;
    weights += agrees;
    for (int k = 0; k < kTerms; ++k) {
      result.change[k] += weighted_off * n.basis[k];
      for (int m = 0; m <= k; ++m) products[at(k, m)] += weight * (n.basis[k] * n.basis[m]);
    }
  }
  // A weak belief in what the cell itself says where its neighbours are few: slopes to 0.1, curvatures to 0.005 / px.
  constexpr float belief[kTerms] = {1e-3f, 100, 100, 40000, 40000, 40000};
  for (int k = 0; k < kTerms; ++k) products[at(k, k)] += belief[k];
  std::copy(result.change, result.change + kTerms, sums);
  factorise(products);
  solve(products, result.change);
  for (int k = 0; k < kTerms; ++k) squares -= sums[k] * result.change[k];
  result.scatter = squares / weights;
  result.variance = corner_of_inverse(products);
  return result;
}

}  // namespace

void smooth_cells(CellGrid& grid, Reach reach) {
  const Planes before(grid);
  const std::vector<Neighbour> around = neighbourhood(reach);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int first = 0; first < grid.columns; first += kLanes) {
      const Quadratics quadratics = fit_quadratics(before, around, first, row);
      for (int lane = 0; lane < std::min(kLanes, grid.columns - first); ++lane) {
        Cell& cell = grid.at(first + lane, row);
        if (!cell.matched) continue;
        const float agreeing = quadratics.agreeing[lane];
        cell.matched = agreeing >= kMinAgreement * quadratics.all[lane] && agreeing >= kMinNeighbours;
        if (!cell.matched) continue;
        cell.plane.d += quadratics.change[0][lane];
        cell.plane.dx += quadratics.change[1][lane];
        cell.plane.dy += quadratics.change[2][lane];
        const float windows = kWindowsPerPixel / static_cast<float>(reach.step * reach.step);
        cell.information =
            std::min(1e6f, 1 / (std::max(1.0f, windows) * std::max(kMinScatter, quadratics.scatter[lane]) *
                                quadratics.variance[lane]));
      }
    }
  });
}

}  // namespace palpate
