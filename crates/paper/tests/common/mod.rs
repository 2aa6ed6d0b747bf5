//! The shipped files, as the command gives them to a comparison.

use std::path::Path;

use certune_closed_loop::{Gains, GainsFile, Scenario};
use certune_dynamics::Robot;
use certune_paper::{Inputs, Published, Scenarios, Size, Spaces};
use certune_tune::SpaceFile;

fn preset(text: &str) -> Gains {
    GainsFile::parse(Path::new("preset"), text).expect("a preset").gains
}

/// Everything as shipped, the gains to be searched.
pub fn inputs() -> Inputs {
    let scenario = |text| Scenario::parse(Path::new("scenario"), text).expect("a scenario");
    let space = |text| SpaceFile::parse(Path::new("space"), text).expect("a space");
    Inputs {
        robot: Robot::panda(),
        approximated: Robot::panda_cuboid(),
        published: Published {
            aic_simulation: preset(include_str!("../../../../tuning/presets/pezzato2020-simulation.toml")),
            aic_robot: preset(include_str!("../../../../tuning/presets/pezzato2020-libfranka.toml")),
            mrac_simulation: preset(include_str!("../../../../tuning/presets/pezzato2020-mrac-simulation.toml")),
            mrac_robot: preset(include_str!("../../../../tuning/presets/pezzato2020-mrac-robot.toml")),
        },
        tuned_aic: None,
        tuned_mrac: None,
        scenarios: Scenarios {
            pick_and_place: scenario(include_str!("../../../../tuning/scenarios/pick-and-place-paper.toml")),
            payloads: scenario(include_str!("../../../../tuning/scenarios/payload-swap.toml")),
            push: scenario(include_str!("../../../../tuning/scenarios/push.toml")),
            noise: scenario(include_str!("../../../../tuning/scenarios/hold.toml")),
        },
        spaces: Spaces {
            aic: space(include_str!("../../../../tuning/spaces/panda-aic.toml")),
            mrac: space(include_str!("../../../../tuning/spaces/panda-mrac.toml")),
        },
        size: Size::default(),
    }
}
