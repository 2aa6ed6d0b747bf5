//! Contract: every story ends as it says.

use std::error::Error;

#[path = "../01_simulate.rs"]
mod simulate;

#[path = "../02_certify.rs"]
mod certify;

#[path = "../03_tune.rs"]
mod tune;

#[test]
fn the_published_gains_reach_every_goal() -> Result<(), Box<dyn Error>> {
    simulate::main()
}

#[test]
fn a_certificate_is_made_checked_and_cannot_be_edited() -> Result<(), Box<dyn Error>> {
    certify::main()
}

#[test]
fn a_small_search_finds_certified_gains() -> Result<(), Box<dyn Error>> {
    tune::main()
}
