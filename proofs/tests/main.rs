//! Every claim in one program: each test needs the certifier, which is compiled once.

#[path = "adaptive-convergence.rs"]
mod adaptive_convergence;
#[path = "adaptive-sampled.rs"]
mod adaptive_sampled;
mod answer;
mod disturbance;
mod exponential;
mod index;
#[path = "joint-region.rs"]
mod joint_region;
mod lyapunov;
#[path = "moving-goal.rs"]
mod moving_goal;
#[path = "pi-exponential.rs"]
mod pi_exponential;
mod region;
mod sampled;
#[path = "sampled-region.rs"]
mod sampled_region;
