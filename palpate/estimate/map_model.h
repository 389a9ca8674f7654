#pragma once

#include "palpate/contact/contact_model.h"
#include "palpate/estimate/tissue_map.h"

namespace palpate {

/// The map as the forward model F(q, radius): finer around the places that are held, out to where tissue tells the
/// force, edges of the stated radius about the patch, of half of it beneath.
ContactModel contact_model(const TissueMap& map, const Rectification& rectification, double radius_mm);

}  // namespace palpate
