//! Which random stream belongs to whom. All streams of one seed are independent (ChaCha8).
//!
//! Plants take the stream of their index, and the sensor noise of a plant the complement of it, so that plants grow from 0 upwards and noise from
//! `u64::MAX` downwards; what is neither lives in the middle.

/// The first plant of the held-out set; the batch of the search starts at 0 and is far smaller than this.
pub const FIRST_HELD_OUT_PLANT: u64 = 1 << 32;
/// The first plant that was searched for instead of drawn.
pub const FIRST_WORST_PLANT: u64 = 1 << 34;
/// The first plant of the stability filter.
pub const FIRST_FILTER_PLANT: u64 = 1 << 33;
/// Configurations of the stability filter.
pub const FILTER_CONFIGURATIONS: u64 = 1 << 62;
/// The particle swarm.
pub const SWARM: u64 = (1 << 62) + 1;
/// The search for the worst plant of a box.
pub const WORST_PLANT: u64 = (1 << 62) + 4;
/// CMA-ES.
pub const CMA_ES: u64 = (1 << 62) + 2;
/// Points over the whole space.
pub const SCATTER: u64 = (1 << 62) + 3;
