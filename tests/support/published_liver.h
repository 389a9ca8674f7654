#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate::test {

/// The synthetic liver of Mestdagh and Cotin (MICCAI 2022) under one of its loads: positions of all nodes and the net
/// force on the loaded ones, as published.
struct PublishedLiver {
  struct Frame {
    int number = 0;
    Eigen::VectorXd u;  ///< mm, 3 per node
    Vec3 force_N = Vec3::Zero();
  };
  TetMesh mesh;
  std::vector<int> clamped, loaded;
  std::vector<Frame> frames;  ///< those whose positions are stored
};

/// `load`: "linear_s1" or "neohookean_s1". Nodes that move although they count as fixed are left out of `clamped`.
PublishedLiver read_published_liver(const std::string& load);

/// The nodes held in one frame: the clamped ones where they are, the loaded ones where the frame has them.
std::map<int, Vec3> held_nodes(const PublishedLiver& liver, const PublishedLiver::Frame& frame);

/// Sum over the loaded nodes.
Vec3 net_force(const PublishedLiver& liver, const Eigen::VectorXd& force_N);

}  // namespace palpate::test
