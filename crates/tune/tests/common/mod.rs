//! Gains of an AIC that every joint shares, by row.
#![allow(dead_code, reason = "each test takes what it needs")]

use std::path::Path;

use certune_closed_loop::{AicTable, PerJoint};
use certune_tune::{Gains, Setting, Space, SpaceFile};

/// Rows of one number.
pub trait Numbers {
    /// The number of a row.
    fn number(&self, row: &str) -> f64;
}

impl Numbers for Gains {
    fn number(&self, row: &str) -> f64 {
        self.row(row).and_then(PerJoint::shared).expect("a row that all joints share")
    }
}

/// Every gain is 1.
pub fn ones() -> Gains {
    AicTable::uniform(1.0).into()
}

/// A space in which some rows move between bounds on a logarithmic scale, and the others are 1.
pub fn space_of(free: &[&str], [lower, upper]: [f64; 2]) -> Space {
    let mut text = "schema = 1\ncontroller = \"aic\"\n[search]\nmethod = \"nelder-mead\"\n[fixed]\n".to_owned();
    for (row, _) in ones().rows().iter().filter(|(row, _)| !free.contains(row)) {
        text.push_str(&format!("{row} = 1.0\n"));
    }
    for row in free {
        text.push_str(&format!("[gains.{row}]\nlower = {lower:?}\nupper = {upper:?}\nscale = \"log\"\n"));
    }
    SpaceFile::parse(Path::new("space.toml"), &text).expect("a valid file").on(Setting::default()).expect("a space")
}
