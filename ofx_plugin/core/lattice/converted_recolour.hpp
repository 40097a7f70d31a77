// Recolouring of pictures whose numbers are not those of the palette.
#pragma once

#include "convert/colour_conversion.hpp"
#include "lattice/lattice.hpp"
#include "recolour/recolour.hpp"

namespace palette4d {

/// Recolours a picture in the clip's numbers with a palette that was found in others. A colour that
/// the edit does not move keeps its bits; what is moved goes to the palette's numbers and back in
/// double precision, so that nothing jumps where an edit begins. Colours with a NaN or an infinity
/// pass. As Recolourer::apply otherwise, and just that without a conversion (null).
RecolourCounts apply_converted(const Recolourer& recolourer, const ColourConversion* conversion,
                               const ConstImageView& in, const ImageView& out,
                               const RecolourOptions& options);
/// Likewise by a lattice of displacements in the palette's numbers. What it does not move, since
/// the nodes around do not move, keeps its bits too; Lattice::kTolerance is of the palette's
/// numbers.
LatticeCounts apply_converted(const Lattice& lattice, const ColourConversion* conversion,
                              const ConstImageView& in, const ImageView& out,
                              const RecolourOptions& options);

}  // namespace palette4d
