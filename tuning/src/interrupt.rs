//! Ctrl-C: the first asks a run to end after its generation, the second ends the process at once, which loses no more than that generation.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::SIGINT;
use signal_hook::flag;

use crate::error::Error;

/// What a shell reports of a process that Ctrl-C has ended.
const INTERRUPTED: u8 = 130;

pub fn exit_code() -> ExitCode {
    ExitCode::from(INTERRUPTED)
}

/// A flag that the first Ctrl-C from now on raises.
pub fn flag_of_ctrl_c() -> Result<Arc<AtomicBool>, Error> {
    let raised = Arc::new(AtomicBool::new(false));
    // In this order: a flag that is not raised yet does not end the process.
    flag::register_conditional_shutdown(SIGINT, INTERRUPTED.into(), Arc::clone(&raised))
        .and_then(|_| flag::register(SIGINT, Arc::clone(&raised)))
        .map_err(Error::Signal)?;
    Ok(raised)
}
