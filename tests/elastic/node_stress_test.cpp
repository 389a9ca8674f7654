#include <gtest/gtest.h>

#include "palpate/elastic/stress.h"

namespace palpate {
namespace {

TEST(NodeStress, ElementsTurnedInsideOutAreLeftOut) {
  // Two tetrahedra on either side of one face; the second one's tip is pushed through it.
  const TetMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}}, {{0, 1, 2, 3}, {0, 2, 1, 4}}, {0, 0}};
  const TetModel model(mesh, {Law::saint_venant_kirchhoff, 27, 0.45, ""}, {});
  Eigen::VectorXd u = Eigen::VectorXd::Zero(15);
  u[11] = 0.1;
  u[14] = 1.001;
  ASSERT_LT(model.smallest_volume_ratio(u), 0);
  const std::vector<double> of_element = element_von_mises_kPa(model, u), of_node = node_von_mises_kPa(model, u);
  ASSERT_GT(of_element[0], 1);
  for (size_t n = 0; n < 4; ++n) EXPECT_DOUBLE_EQ(of_node[n], of_element[0]);
  EXPECT_EQ(of_node[4], 0);
}

}  // namespace
}  // namespace palpate
