#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "tests/support/prescribed.h"
#include "tests/support/published_liver.h"
#include "tests/support/reference_data.h"

/// What each law and element returns where forces have been published (Mestdagh and Cotin, MICCAI 2022): the loaded
/// nodes of a liver moved by up to 60 mm. The published ones come from plain linear elements, of small-strain
/// elasticity and of a neo-Hookean law with a logarithmic volume term.
namespace {

using namespace palpate;

void print_row(const test::PublishedLiver& liver, const test::PublishedLiver::Frame& frame, TissueOptions tissue,
               Element element) {
  const auto held = test::held_nodes(liver, frame);
  const TetModel model(liver.mesh, tissue, test::nodes_of(held), element);
  const int steps = tissue.law == Law::linear ? 1 : 5;
  const test::PrescribedEquilibrium found = test::solve_prescribed(model, held, steps);
  fmt::print("{:22} {:9}", law_name(tissue.law), element == Element::linear ? "linear" : "averaged");
  if (!found.converged) {
    fmt::print("  no equilibrium found\n");
    return;
  }
  const double force_N = test::net_force(liver, found.force).norm();
  fmt::print("{:9.4f} {:9.4f} {:9.4f} {:11.2f}   {}\n", force_N, frame.force_N.norm(), force_N / frame.force_N.norm(),
             model.smallest_volume_ratio(found.u), model.in_valid_range(found.u) ? "yes" : "no");
}

void print_table(const std::string& load, double young_modulus_kPa, double poisson_ratio) {
  const test::PublishedLiver liver = test::read_published_liver(load);
  for (const test::PublishedLiver::Frame& frame : {liver.frames.front(), liver.frames.back()}) {
    fmt::print("\n{}, frame {}: E = {} kPa, nu = {}\n", load, frame.number, young_modulus_kPa, poisson_ratio);
    fmt::print("law                    element    force N published     ratio  smallest J   in valid range\n");
    for (Law law : {Law::linear, Law::saint_venant_kirchhoff, Law::neo_hookean, Law::corotated})
      for (Element element : {Element::linear, Element::averaged})
        print_row(liver, frame, {law, young_modulus_kPa, poisson_ratio, ""}, element);
  }
}

}  // namespace

int main() {
  if (!std::filesystem::exists(test::reference_data() / "mestdagh_liver")) {
    fmt::print("reference data missing: {}\n", (test::reference_data() / "mestdagh_liver").string());
    return EXIT_FAILURE;
  }
  print_table("linear_s1", 20, 0.45);
  print_table("neohookean_s1", 4.5, 0.49);
  return EXIT_SUCCESS;
}
