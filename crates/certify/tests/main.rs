//! All in one program: each test needs the search for proofs, which is compiled once.

mod joint_region;
mod lyapunov;
mod panda_constants;
mod sampled;
mod sampled_region;
