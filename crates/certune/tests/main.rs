//! All in one program: each test needs the certifier of a seven-joint arm, which is compiled once.

mod mutants;
mod panda;
mod predictions;
mod sampled_region;
mod soundness;
