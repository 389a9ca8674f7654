#include "palpate/contact/contact_options.h"

namespace palpate {

void describe(Settings& settings, ContactOptions& options) {
  settings.number("threshold_mm", options.threshold_mm, {0, 20, true, false},
                  "T of Eq. 4: a tip nearer to the surface than this arms the contact");
  settings.number("footprint_radius_mm", options.footprint_radius_mm, {0, 50, true, false},
                  "radius of the patch of tissue that the tip holds");
  settings.choice<Grip>("grip", options.grip, {{"auto", Grip::automatic}, {"grasp", Grip::grasp}, {"push", Grip::push}},
                        "grasp ties the patch in all directions, push never pulls, auto decides by what happens");
  settings.number("friction", options.friction, {0, 10}, "Coulomb coefficient of a push");
  settings.choice<Drive>("drive", options.drive, {{"fused", Drive::fused}, {"tip", Drive::tip}},
                         "fused: tip and tissue in one estimate, radius and scene motion unknown; tip: the paper's "
                         "way, the tip's displacement with the radius as stated");
}

}  // namespace palpate
