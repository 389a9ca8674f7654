#pragma once

#include "palpate/contact/contact_options.h"
#include "palpate/elastic/material.h"
#include "palpate/simulate/simulate_options.h"
#include "palpate/volume/attachments.h"

namespace palpate {

/// Everything that simulate_dejavu needs.
struct SimulatedCase {
  SimulateOptions simulate;
  TissueOptions tissue;
  AttachmentOptions attachments;
  ContactOptions contact;
};

/// The paper's uterus: closed organ of 62 mm, 400 kPa, 0.35, attached at its back; a grasper comes in, pulls by 2.4 mm
/// with some drag, goes back, pushes by 1.2 mm, lets go and leaves.
SimulatedCase uterus_demo();

}  // namespace palpate
