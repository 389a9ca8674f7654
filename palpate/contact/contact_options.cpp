#include "palpate/contact/contact_options.h"

#include "palpate/core/errors.h"

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
  settings.points(
      "at_px", options.at_px,
      "[x, y] in the left image as recorded, where the tissue is held: force from the visible surface alone, "
      "with instrument.segmentation: none");
  settings.integer("at_frame", options.at_frame, {-1, 1e9},
                   "frame in which it is taken hold of there; -1: when the tissue says so");
  settings.after_reading([&options] {
    if (options.at_px.size() > 1) throw BadInput("contact.at_px is a polygon, expected one pixel [x, y]");
    if (options.at_frame >= 0 && options.at_px.empty())
      throw BadInput("contact.at_frame needs contact.at_px, the place where the tissue is held");
  });
}

}  // namespace palpate
