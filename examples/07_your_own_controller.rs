//! A controller of one's own behind the trait `Controller`, beside the active inference controller on the Panda.
//!
//! `cargo run --release -p examples --example 07_your_own_controller`

use std::error::Error;
use std::path::Path;

use certune::closed_loop::{Metrics, NoiseStream, Plant, PlantSetting, Scenario, simulate};
use certune::control::aic::{Aic, AicParams};
use certune::control::{Controller, Measurement};
use certune::dynamics::Robot;
use certune::linsys::Joints;
use certune_testkit::PUBLISHED;

/// PD without a tachometer: the speed is a low-pass filtered difference of positions.
struct Pd {
    stiffness_n_m_per_rad: Joints<7>,
    damping_n_m_s_per_rad: Joints<7>,
    filter_s: f64,
    step_s: f64,
}

/// What it remembers. `Copy`: a run can be forked at any step.
#[derive(Clone, Copy, Debug)]
struct PdState {
    q: Joints<7>,
    speed: Joints<7>,
}

impl Controller<7> for Pd {
    type State = PdState;

    fn start(&self, at: &Measurement<7>) -> PdState {
        PdState { q: at.q, speed: Joints::zeros() }
    }

    fn step(&self, state: &PdState, at: &Measurement<7>, goal: &Joints<7>) -> (PdState, Joints<7>) {
        let difference = (at.q - state.q) / self.step_s;
        let speed = state.speed + (difference - state.speed) * (self.step_s / (self.filter_s + self.step_s));
        let pull = self.stiffness_n_m_per_rad.component_mul(&(goal - at.q));
        let drag = self.damping_n_m_s_per_rad.component_mul(&speed);
        (PdState { q: at.q, speed }, pull - drag)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let robot = Robot::panda();
    let file = Path::new("tuning/scenarios/payload-swap.toml");
    let scenario = Scenario::parse(file, include_str!("../tuning/scenarios/payload-swap.toml"))?;
    let aic = Aic::new(&AicParams::new(&PUBLISHED.on_every_joint(), scenario.step_s)?);
    let pd = Pd {
        stiffness_n_m_per_rad: [120.0, 120.0, 120.0, 120.0, 15.0, 15.0, 8.0].into(),
        damping_n_m_s_per_rad: [45.0, 45.0, 30.0, 30.0, 3.0, 3.0, 1.0].into(),
        filter_s: 2e-3,
        step_s: scenario.step_s,
    };

    // Both meet the same arm, which compensates its own weight and not that of the bottles it carries.
    let plant = Plant::<7>::new(&robot, &PlantSetting::nominal(&robot, true))?;
    let task = scenario.bind(&robot)?;
    let of_pd = simulate(&plant, &task, &pd, NoiseStream::default(), &mut ());
    let of_aic = simulate(&plant, &task, &aic, NoiseStream::default(), &mut ());
    let error_mrad = |metrics: &Metrics, goal: usize| 1e3 * metrics.segments[goal].worst_final_error_rad();
    for goal in 0..of_pd.segments.len() {
        let [pd, aic] = [&of_pd, &of_aic].map(|metrics| error_mrad(metrics, goal));
        println!("goal {:>2}: worst error at its end {pd:>6.2} mrad PD, {aic:>5.2} mrad AIC", goal + 1);
    }

    assert_eq!((of_pd.diverged_at_s, of_aic.diverged_at_s), (None, None));
    // Empty-handed, both are at the first goal. With the full bottle in hand (goals 8 and 9) a PD stays where its spring balances the
    // bottle; the AIC, which integrates, does not.
    assert!(error_mrad(&of_pd, 0) < 5.0 && error_mrad(&of_aic, 0) < 5.0);
    for goal in [7, 8] {
        assert!(error_mrad(&of_pd, goal) > 4.0 * error_mrad(&of_aic, goal));
    }
    Ok(())
}
