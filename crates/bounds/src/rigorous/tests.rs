//! Bounds against random members, against dense grids, and the rounding argument against exact arithmetic.
