#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "palpate/infer/filter_state.h"

#include "palpate/core/quantile.h"

namespace palpate {

void FilterState::report(size_t instrument, const ContactFit& fit, const TipObservation& tip,
                         InstrumentAnswer& answer) const {
  const Hand& hand = hands[instrument];
  const size_t k = *hand.contact;
  const SceneMotion scene = fit.posterior.scene(about_mm);
  const Mat3 R = scene.rotation();
  const ForceAt force = force_at(*body, fit.posterior, k);
  answer.hold = hand.filter.most_probable();
  answer.p_contact = hand.filter.p_contact();
  answer.converged = fit.converged;
  answer.force_N = R * force.force_N;
  answer.force_covariance_N2 = R * force_covariance(force, fit) * R.transpose();
  const auto row = 3 * static_cast<Eigen::Index>(k);
  answer.tangent = {R * body->response.force.block<3, 3>(row, row) * R.transpose(), R * fit.posterior.q_mm(k),
                    R * model.footprint(k).normal};
  answer.correlation = force_correlation(force, fit.posterior, k);
  const ContactForce& solved = body->response.equilibrium.contacts[k];
  const double solved_N = solved.force_N.norm();
  answer.mean_nodal_force_N =
      solved_N > 0 ? solved.mean_nodal_force_N * force.force_N.norm() / solved_N : solved.mean_nodal_force_N;
  answer.place_mm = model.footprint(k).center_mm;
  answer.q_mm = fit.posterior.q_mm(k);
  answer.footprint_mm = std::exp(fit.posterior.log_radius(k));
  answer.tip_inferred = !tip.visible;
  answer.tip_mm = scene.apply(model.footprint(k).center_mm + fit.posterior.q_mm(k));
  const double attachments_mm = model.distance_to_attachments_mm(k);
  answer.near_attachment = attachments_mm < 2 * options.footprint_radius_mm;
  answer.stretch = answer.q_mm.norm() / std::max(attachments_mm, 5 * options.footprint_radius_mm);
}

std::vector<PointMisfit> FilterState::misfits(const std::vector<TissuePoint>& tissue, const Belief& at) const {
  PredictedBody predicted{nullptr, nullptr, at.mean, about_mm};
  if (body) predicted = {&body->response, &body->places, body->unknowns(at), about_mm, &patches};
  const std::vector<Measurement> rows = tissue_measurements(tissue, predicted, rectification, parameters);
  const double max_distance2 = std::pow(parameters.unexplained_deviations, 2);
  std::vector<PointMisfit> misfits;
  for (size_t i = 0; i < rows.size(); ++i) {
    const Eigen::VectorXd residual = rows[i].residual - rows[i].H * (at.mean - predicted.x0);
    misfits.push_back({residual.head<2>().norm() * tissue[i].rest_mm.z() / rectification.focal_px,
                       residual.dot(rows[i].covariance.ldlt().solve(residual)) <= max_distance2});
  }
  return misfits;
}

double FilterState::misfit_mm(const FrameData& data, const Belief& at, bool& explained) const {
  std::vector<double> all_mm;
  double unexplained = 0;
  for (const PointMisfit& misfit : misfits(data.tissue, at)) {
    all_mm.push_back(misfit.mm);
    unexplained += !misfit.explained;
  }
  explained = all_mm.size() < 10 || unexplained < parameters.unexplained_ratio * static_cast<double>(all_mm.size());
  if (all_mm.empty()) return 0;
  return median_of(all_mm);
}

}  // namespace palpate
