//! Robots, presets, scenarios and search spaces, by built-in name or by path.
//!
//! A name wins over a file of the same name in the current folder; `./NAME` is the file.

use std::path::{Path, PathBuf};

use certune::closed_loop::file::{load, nearest};
use certune::closed_loop::{AicTable, GainsFile, KeyError, PlantBox, Scenario};
use certune::control::aic::{AicGains, AicParams};
use certune::control::mrac::MracParams;
use certune::dynamics::{BUILT_IN, MOST_JOINTS, Robot, RobotError};
use certune::tune::SpaceFile;
use certune::verify::Record;

use crate::cli::ControllerName;
use crate::error::{Error, Kind};
use crate::output;

/// Published gains, each file with its source.
pub const PRESETS: [(&str, &str); 5] = [
    ("pezzato2020-simulation", include_str!("../presets/pezzato2020-simulation.toml")),
    ("pezzato2020-libfranka", include_str!("../presets/pezzato2020-libfranka.toml")),
    ("pezzato2020-robot", include_str!("../presets/pezzato2020-robot.toml")),
    ("pezzato2020-mrac-simulation", include_str!("../presets/pezzato2020-mrac-simulation.toml")),
    ("pezzato2020-mrac-robot", include_str!("../presets/pezzato2020-mrac-robot.toml")),
];

/// Tasks with their plant boxes.
pub const SCENARIOS: [(&str, &str); 6] = [
    ("pick-and-place", include_str!("../scenarios/pick-and-place.toml")),
    ("pick-and-place-ramped", include_str!("../scenarios/pick-and-place-ramped.toml")),
    ("pick-and-place-paper", include_str!("../scenarios/pick-and-place-paper.toml")),
    ("hold", include_str!("../scenarios/hold.toml")),
    ("payload-swap", include_str!("../scenarios/payload-swap.toml")),
    ("push", include_str!("../scenarios/push.toml")),
];

/// Search spaces; the first of a controller is its default.
pub const SPACES: [(&str, &str); 2] = [
    ("panda-aic", include_str!("../spaces/panda-aic.toml")),
    ("panda-mrac", include_str!("../spaces/panda-mrac.toml")),
];

/// Proved constants, each record of one robot over one set of configurations.
pub const CONSTANTS: [(&str, &str); 4] = [
    ("panda", include_str!("../constants/panda.json")),
    ("panda-masses-payload-rotor", include_str!("../constants/panda-masses-payload-rotor.json")),
    ("panda-payload-3", include_str!("../constants/panda-payload-3.json")),
    ("panda-rotor-0.1", include_str!("../constants/panda-rotor-0.1.json")),
];

/// The preset that a run is compared with when its search space names none.
pub const fn default_preset(controller: ControllerName) -> &'static str {
    match controller {
        ControllerName::Aic => "pezzato2020-simulation",
        ControllerName::Mrac => "pezzato2020-mrac-simulation",
    }
}

/// The scenario of the built-in robots.
const DEFAULT_SCENARIO: &str = "pick-and-place";

/// What a robot is, for a list.
pub fn robot_in_words(name: &str) -> &'static str {
    match name {
        "panda" => "Franka Emika Panda with its hand, identified inertials",
        "panda-bare" => "the same arm without the hand",
        "panda-cuboid" => "the Panda with links as uniform boxes, rotor inertia 0.1 kg m²",
        _ => "",
    }
}

/// A text with the name under which errors speak of it.
struct Text {
    name: String,
    file: PathBuf,
    text: String,
}

/// Whether a word on the command line means a file.
fn is_path(given: &str, extensions: &[&str]) -> bool {
    let extension = Path::new(given).extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    given.contains(['/', '\\']) || extensions.contains(&extension) || Path::new(given).exists()
}

fn unknown(kind: Kind, given: &str, known: Vec<&'static str>) -> Error {
    let nearest = nearest(given, known.iter().copied()).map(str::to_owned);
    Error::Unknown { kind, name: given.to_owned(), nearest, known }
}

fn find(kind: Kind, given: &str, built_in: &[(&'static str, &'static str)]) -> Result<Text, Error> {
    if let Some((name, text)) = built_in.iter().find(|(name, _)| *name == given) {
        return Ok(Text {
            name: given.to_owned(),
            file: PathBuf::from(format!("{name}.toml (built in)")),
            text: (*text).to_owned(),
        });
    }
    if is_path(given, &["toml"]) {
        let file = PathBuf::from(given);
        return Ok(Text { name: given.to_owned(), text: load(&file)?, file });
    }
    Err(unknown(kind, given, built_in.iter().map(|(name, _)| *name).collect()))
}

/// The robot of that name or in that URDF file, of a size that the commands are compiled for.
pub fn robot(given: &str, tip: Option<&str>) -> Result<Robot, Error> {
    let robot = match Robot::built_in(given) {
        Some(robot) => robot,
        None if is_path(given, &["urdf", "xml", "xacro"]) => {
            let file = Path::new(given);
            Robot::from_urdf_file(file, tip).map_err(|source| Error::Robot {
                // This one names the file itself.
                file: (!matches!(source, RobotError::Read { .. })).then(|| file.to_path_buf()),
                source,
            })?
        }
        None => return Err(unknown(Kind::Robot, given, BUILT_IN.to_vec())),
    };
    if (1..=MOST_JOINTS).contains(&robot.joints()) { Ok(robot) } else { Err(too_many_joints(&robot)) }
}

/// Where the file of a robot is that is not built in, whatever folder it is asked for from.
pub fn robot_file(given: &str) -> Result<Option<PathBuf>, Error> {
    let absolute = |given| std::path::absolute(given).map_err(output::cannot("find", Path::new(given)));
    Robot::built_in(given).is_none().then(|| absolute(given)).transpose()
}

/// For a dispatch over the number of joints that found no match.
pub fn too_many_joints(robot: &Robot) -> Error {
    Error::Joints { robot: robot.name().to_owned(), joints: robot.joints(), most: MOST_JOINTS }
}

/// Gains with the text they were read from.
pub struct GainsSource {
    /// As given on the command line.
    pub name: String,
    file: PathBuf,
    text: String,
    /// The numbers.
    pub gains: GainsFile,
}

impl GainsSource {
    /// The preset of that name, or the file.
    pub fn find(given: &str) -> Result<Self, Error> {
        let Text { name, file, text } = find(Kind::Preset, given, &PRESETS)?;
        let gains = GainsFile::parse(&file, &text)?;
        Ok(Self { name, file, text, gains })
    }

    /// The AIC's gains for `N` joints, checked.
    pub fn aic_gains<const N: usize>(&self, table: &AicTable, step_s: f64) -> Result<AicGains<N>, Error> {
        let gains = table.bind().map_err(|error| self.locate(error))?;
        AicParams::<N>::new(&gains, step_s).map_err(|source| Error::Gains { gains: self.name.clone(), source })?;
        Ok(gains)
    }

    /// The AIC's parameters for `N` joints.
    pub fn aic_params<const N: usize>(&self, table: &AicTable, step_s: f64) -> Result<AicParams<N>, Error> {
        let gains = table.bind().map_err(|error| self.locate(error))?;
        AicParams::new(&gains, step_s).map_err(|source| Error::Gains { gains: self.name.clone(), source })
    }

    /// The MRAC's parameters for `N` joints.
    pub fn mrac_params<const N: usize>(
        &self,
        table: &certune::closed_loop::MracTable,
        step_s: f64,
    ) -> Result<MracParams<N>, Error> {
        let gains = table.bind().map_err(|error| self.locate(error))?;
        MracParams::new(&gains, step_s).map_err(|source| Error::Gains { gains: self.name.clone(), source })
    }

    fn locate(&self, error: KeyError) -> Error {
        error.locate(&self.file, &self.text).into()
    }
}

/// The scenario of that name or file, checked against the robot.
pub fn scenario(given: Option<&str>, robot: &Robot) -> Result<Scenario, Error> {
    let given = match given {
        Some(given) => given,
        None if Robot::built_in(robot.name()).is_some_and(|built_in| built_in == *robot) => DEFAULT_SCENARIO,
        None => return Ok(Scenario::generic(robot, generic_box())),
    };
    let scenario = scenario_file(given)?;
    if scenario.joints() != robot.joints() {
        let source = Box::new(KeyError::per_joint("start_rad", scenario.joints(), robot.joints()));
        return Err(Error::ScenarioFit { scenario: scenario.name, robot: robot.name().to_owned(), source });
    }
    Ok(scenario)
}

/// The scenario of that name or file, for whatever robot.
pub fn scenario_file(given: &str) -> Result<Scenario, Error> {
    let Text { file, text, .. } = find(Kind::Scenario, given, &SCENARIOS)?;
    Ok(Scenario::parse(&file, &text)?)
}

/// Whether a built-in scenario says the same.
pub fn is_built_in(scenario: &Scenario) -> bool {
    scenario_file_of(&scenario.name).is_some_and(|built_in| built_in == *scenario)
}

fn scenario_file_of(name: &str) -> Option<Scenario> {
    let (name, text) = SCENARIOS.iter().find(|(known, _)| *known == name)?;
    Scenario::parse(Path::new(name), text).ok()
}

/// The plants of a robot about which nothing else is known.
fn generic_box() -> PlantBox {
    PlantBox {
        mass_uncertainty: 0.2,
        payload_kg: [0.0; 2],
        friction_n_m_s_per_rad: [0.5, 2.0],
        rotor_inertia_kg_m2: [0.0, 0.1],
        delay_samples: [0; 2],
        gravity_compensation: true,
    }
}

/// The built-in records of proved constants, and those of the files.
pub fn records(files: &[PathBuf]) -> Result<Vec<Record>, Error> {
    let built_in = CONSTANTS.iter().map(|(name, text)| parsed(Path::new(name), text));
    built_in.chain(files.iter().map(|path| record(path))).collect()
}

/// The record of proved constants in a file.
pub fn record(path: &Path) -> Result<Record, Error> {
    parsed(path, &output::read_file(path)?)
}

/// The built-in robot that a record is about.
pub fn robot_of(record: &Record) -> Result<Robot, Error> {
    let built_in = BUILT_IN.iter().filter_map(|name| Robot::built_in(name));
    built_in
        .into_iter()
        .find(|robot| robot.sha256() == record.arm.sha256)
        .ok_or_else(|| Error::RobotOfRecord { robot: record.arm.name.clone(), sha256: record.arm.sha256.clone() })
}

fn parsed(path: &Path, text: &str) -> Result<Record, Error> {
    Record::parse(text)
        .map_err(|source| Error::Record { path: path.to_path_buf(), source })?
        .map_err(|source| Error::RecordRejected { path: path.to_path_buf(), source })
}

/// A search space with the text it was read from.
pub struct SpaceSource {
    /// The name for the record.
    pub name: String,
    pub text: String,
    pub space: SpaceFile,
}

/// The search space of that file, or the built-in one of the controller.
pub fn space(given: Option<&str>, controller: Option<ControllerName>) -> Result<SpaceSource, Error> {
    let built_in = match controller {
        None | Some(ControllerName::Aic) => SPACES[0].0,
        Some(ControllerName::Mrac) => SPACES[1].0,
    };
    let given = given.unwrap_or(built_in);
    let Text { file, text, .. } = find(Kind::Space, given, &SPACES)?;
    let name = Path::new(given).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let space = SpaceFile::parse(&file, &text)?;
    match controller {
        Some(wanted) if wanted.name() != space.controller() => {
            Err(Error::OtherController { space: given.to_owned(), found: space.controller(), wanted: wanted.name() })
        }
        _ => Ok(SpaceSource { name: name.unwrap_or_default(), text, space }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stems(folder: &str) -> Vec<String> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let entries = std::fs::read_dir(path).unwrap();
        let mut stems: Vec<_> =
            entries.map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned()).collect();
        stems.sort();
        stems
    }

    fn sorted(list: &[(&str, &str)]) -> Vec<String> {
        let mut names: Vec<_> = list.iter().map(|(name, _)| (*name).to_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn every_file_of_the_folders_is_built_in() {
        assert_eq!(stems("presets"), sorted(&PRESETS));
        assert_eq!(stems("scenarios"), sorted(&SCENARIOS));
        assert_eq!(stems("spaces"), sorted(&SPACES));
    }

    #[test]
    fn everything_built_in_reads() {
        for (name, _) in PRESETS {
            assert!(GainsSource::find(name).unwrap().gains.source.is_some());
        }
        for (name, _) in SCENARIOS {
            let scenario = scenario(Some(name), &Robot::panda()).unwrap();
            assert!(scenario.name == name && is_built_in(&scenario));
        }
        for record in records(&[]).unwrap() {
            let robot = Robot::built_in(&record.arm.name).unwrap();
            assert_eq!(
                robot.sha256(),
                record.arm.sha256,
                "the record is not about this version of `{}`",
                record.arm.name
            );
        }
        for controller in [ControllerName::Aic, ControllerName::Mrac] {
            let SpaceSource { name, space, .. } = space(None, Some(controller)).unwrap();
            assert_eq!((name, space.controller()), (format!("panda-{}", controller.name()), controller.name()));
            assert_eq!(space.start(), Some(default_preset(controller)));
        }
        assert!(BUILT_IN.iter().all(|name| !robot_in_words(name).is_empty()));
    }
}
