#include "palpate/infer/contact_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "palpate/infer/agreed_radius.h"

namespace palpate {

namespace {

constexpr int kMaxSolves = 3;
/// q has settled when it moves less than this, or less than this ratio of itself.
constexpr double kSettled_mm = 0.03, kSettledRatio = 0.01;

std::vector<Measurement> rows_of(const FrameData& data, const PredictedBody& body, const ContactModel* model,
                                 const FitContext& context) {
  std::vector<Measurement> rows = tissue_measurements(data.tissue, body, context.rectification, context.parameters);
  if (!context.tissue_drives)
    for (Measurement& row : rows) row.H.rightCols(row.H.cols() - Unknowns::kScene).setZero();
  for (const ContactTip& tip : data.tips)
    if (model)
      rows.push_back(tip_measurement(tip.tip_mm, tip.covariance_mm2, tip.contact,
                                     model->footprint(tip.contact).center_mm, body, context.parameters));
  return rows;
}

/// What is kept knows nothing of the operator's word on the radius, so that it is heard once and not in every frame
/// anew; `posterior` has heard it.
ContactFit fit_rows(const Belief& prior, const FrameData& data, const PredictedBody& body, const ContactModel* model,
                    const FitContext& context, const std::vector<Measurement>& further = {}) {
  std::vector<Measurement> rows = rows_of(data, body, model, context);
  rows.insert(rows.end(), further.begin(), further.end());
  const MapEstimate from_data = maximum_a_posteriori(prior, body.x0, rows);
  const double chi2_ratio = from_data.dof > 0 ? from_data.chi2 / from_data.dof : 1;
  ContactFit fit{from_data.posterior, from_data.posterior, from_data.log_evidence, chi2_ratio, true};
  for (size_t k = 0; k < prior.contacts() && context.tissue_drives; ++k) {
    const Eigen::Index at = Unknowns::log_radius(k);
    const AgreedRadius radius =
        agreed_radius(fit.kept.mean[at], fit.kept.covariance(at, at), context.stated_log_radius, context.parameters);
    with_marginal(at, radius.log_radius, radius.variance, fit.posterior);
  }
  return fit;
}

}  // namespace

Eigen::VectorXd SolvedBody::unknowns(const Belief& at) const {
  Eigen::VectorXd x = at.mean;
  for (size_t k = 0; k < q_mm.size(); ++k) {
    x.segment<3>(Unknowns::q(k)) = q_mm[k];
    x[Unknowns::log_radius(k)] = log_radius[k];
  }
  return x;
}

ContactFit fit_at_rest(const Belief& prior, const FrameData& data, const FitContext& context) {
  const PredictedBody body{nullptr, nullptr, prior.mean, context.about_mm};
  return fit_rows(prior, data, body, nullptr, context);
}

ContactFit fit_linear(const Belief& prior, const FrameData& data, const SolvedBody& body, const ContactModel& model,
                      const FitContext& context, const std::vector<Measurement>& further) {
  const PredictedBody predicted{&body.response, &body.places, body.unknowns(prior), context.about_mm, &context.patches};
  return fit_rows(prior, data, predicted, &model, context, further);
}

ContactFit fit_contacts(const Belief& prior, const FrameData& data, SolvedBody& body, ContactModel& model,
                        const FitContext& context) {
  ContactFit fit = fit_linear(prior, data, body, model, context);
  for (int solve = 0; solve < kMaxSolves; ++solve) {
    std::vector<Vec3> q_mm;
    double moved_mm = 0, farthest_mm = 0;
    for (size_t k = 0; k < prior.contacts(); ++k) {
      q_mm.push_back(fit.posterior.q_mm(k));
      moved_mm = std::max(moved_mm, (q_mm[k] - body.q_mm[k]).norm());
      farthest_mm = std::max(farthest_mm, q_mm[k].norm());
    }
    if (solve > 0 && moved_mm < std::max(kSettled_mm, kSettledRatio * farthest_mm)) break;
    const Equilibrium equilibrium = model.solve(q_mm);
    if (!equilibrium.converged) {
      fit.converged = false;
      return fit;
    }
    body.response = model.respond(equilibrium, q_mm);
    body.q_mm = std::move(q_mm);
    for (size_t k = 0; k < prior.contacts(); ++k) body.log_radius[k] = std::log(model.radius_mm(k));
    // Linearized anew where this fit has led.
    const PredictedBody predicted{&body.response, &body.places, body.unknowns(fit.posterior), context.about_mm,
                                  &context.patches};
    fit = fit_rows(prior, data, predicted, &model, context);
  }
  return fit;
}

SolvedBody without_force(const SolvedBody& body, size_t contact) {
  SolvedBody without = body;
  const auto k = static_cast<Eigen::Index>(contact);
  const ContactResponse& full = body.response;
  // The patch gives way until it bears nothing: dq_k = -C_kk^-1 (F_k + C_kj dq_j).
  const Mat3 own = full.force.block<3, 3>(3 * k, 3 * k);
  const Mat3 compliance = own.partialPivLu().solve(Mat3::Identity());
  const Vec3 force_N = full.equilibrium.contacts.at(contact).force_N;
  const Eigen::MatrixXd motion_k = full.motion.middleCols<3>(3 * k);
  const Eigen::MatrixXd gives = compliance * full.force.middleRows<3>(3 * k);
  ContactResponse& response = without.response;
  response.equilibrium.u -= motion_k * (compliance * force_N);
  response.motion -= motion_k * gives;
  response.force -= full.force.middleCols<3>(3 * k) * gives;
  const Eigen::VectorXd forces_change = full.force.middleCols<3>(3 * k) * (compliance * force_N);
  for (size_t j = 0; j < response.equilibrium.contacts.size(); ++j)
    response.equilibrium.contacts[j].force_N -= forces_change.segment<3>(3 * static_cast<Eigen::Index>(j));
  const auto drop = [&](Eigen::MatrixXd& m, Eigen::Index first, Eigen::Index count, bool rows) {
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < (rows ? m.rows() : m.cols()); ++i)
      if (i < first || i >= first + count) kept.push_back(i);
    m = rows ? Eigen::MatrixXd(m(kept, Eigen::all)) : Eigen::MatrixXd(m(Eigen::all, kept));
  };
  drop(response.motion, 3 * k, 3, false);
  drop(response.force, 3 * k, 3, false);
  drop(response.force, 3 * k, 3, true);
  drop(response.motion_per_log_radius, k, 1, false);
  drop(response.force_per_log_radius, k, 1, false);
  drop(response.force_per_log_radius, 3 * k, 3, true);
  response.equilibrium.contacts.erase(response.equilibrium.contacts.begin() + k);
  without.q_mm.erase(without.q_mm.begin() + k);
  without.log_radius.erase(without.log_radius.begin() + k);
  return without;
}

ForceAt force_at(const SolvedBody& body, const Belief& belief, size_t contact) {
  const ContactResponse& r = body.response;
  const auto k = static_cast<Eigen::Index>(contact);
  ForceAt at;
  at.force_N = r.equilibrium.contacts.at(contact).force_N;
  at.per_unknown = Eigen::MatrixXd::Zero(3, belief.mean.size());
  for (size_t j = 0; j < belief.contacts(); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    at.per_unknown.middleCols<3>(Unknowns::q(j)) = r.force.block<3, 3>(3 * k, 3 * column);
    at.per_unknown.col(Unknowns::log_radius(j)) = r.force_per_log_radius.block<3, 1>(3 * k, column);
  }
  const Eigen::VectorXd dx = belief.mean - body.unknowns(belief);
  at.force_N += at.per_unknown * dx;
  return at;
}

}  // namespace palpate
