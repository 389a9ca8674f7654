#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "palpate/volume/tetrahedralize.h"
#include "tests/support/prescribed.h"
#include "tests/support/published_liver.h"
#include "tests/support/punched_dome.h"
#include "tests/support/reference_data.h"

/// Forces against other programs'. First a rigid disc on a dome, by CalculiX; then what each law and element returns
/// where forces have been published (Mestdagh and Cotin, MICCAI 2022): the loaded nodes of a liver moved by up to 60
/// mm. The published ones come from plain linear elements, of small-strain elasticity and of a neo-Hookean law with a
/// logarithmic volume term.
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

/// The disc on the dome against quadratic elements by CalculiX, with the meshes graded to a third of its radius.
void print_punches() {
  fmt::print("\nRigid disc tied to a dome, error of the force in % (averaged / plain elements; goal at 1344: 3)\n");
  fmt::print("elements");
  for (const test::PunchReference& punch : test::kPunchReferences)
    fmt::print("  {} {} {:+} mm", punch.law == Law::neo_hookean ? "NH" : "SVK", punch.poisson_ratio,
               punch.displacement_mm);
  fmt::print("\n");
  for (int elements : {1344, 2500, 5000, 10000}) {
    const TetMesh mesh = test::graded_dome(elements, test::kPunchReferences[0].radius_mm);
    fmt::print("{:8}", mesh.tetrahedra.size());
    for (const test::PunchReference& punch : test::kPunchReferences)
      fmt::print("   {:+5.1f} / {:+5.1f}",
                 100 * (test::punch_force_N(mesh, punch, Element::averaged) / punch.force_N - 1),
                 100 * (test::punch_force_N(mesh, punch, Element::linear) / punch.force_N - 1));
    fmt::print("\n");
  }
}

/// The force of one footprint on ever finer meshes, and on a coarse one refined as a contact refines it.
void print_footprints() {
  const test::PunchReference pull{Law::neo_hookean, 0.45, 2, -1.5, 0}, push{Law::neo_hookean, 0.45, 2, 1, 0};
  fmt::print("\nFootprint of 2 mm: force in N (goals: graded within 3 % of each other, uniform within 10 % of them)\n");
  fmt::print("mesh                 elements   pull     push\n");
  const auto print_mesh = [&](const char* name, const TetMesh& mesh) {
    fmt::print("{:20} {:8} {:8.4f} {:8.4f}\n", name, mesh.tetrahedra.size(),
               test::punch_force_N(mesh, pull, Element::averaged), test::punch_force_N(mesh, push, Element::averaged));
  };
  for (int elements : {1000, 1344, 2500, 5000, 10000, 25000, 50000})
    print_mesh("graded", test::graded_dome(elements, 2));
  const TetMesh uniform = tetrahedralize(test::dome_surface({}, 2), 1344);
  print_mesh("uniform", uniform);
  print_mesh("uniform, refined", refine_near(uniform, Vec3::Zero(), 2, 2));
}

void print_references() {
  for (const test::PunchReference& punch : test::kPunchReferences)
    for (int sectors : {4, 5})
      fmt::print("{} {} {:+} mm, {} edges along a quarter of the rim: {:.4f} N\n", law_name(punch.law),
                 punch.poisson_ratio, punch.displacement_mm, sectors, test::quadratic_punch_force_N(punch, sectors));
}

}  // namespace

int main(int arguments, char** argument) {
  if (arguments > 1 && std::string(argument[1]) == "--references") {
    print_references();
    return EXIT_SUCCESS;
  }
  print_punches();
  print_footprints();
  if (!std::filesystem::exists(test::reference_data() / "mestdagh_liver")) {
    fmt::print("reference data missing: {}\n", (test::reference_data() / "mestdagh_liver").string());
    return EXIT_FAILURE;
  }
  print_table("linear_s1", 20, 0.45);
  print_table("neohookean_s1", 4.5, 0.49);
  return EXIT_SUCCESS;
}
