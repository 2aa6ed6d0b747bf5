//! One file a command: read what it needs, call the library, print.

pub mod ask_tell;
pub mod certify;
pub mod claims;
pub mod compare;
pub mod constants;
pub mod diff;
pub mod evaluate;
pub mod front;
pub mod inspect;
pub mod lists;
pub mod report;
pub mod resume;
pub mod runs;
pub mod simulate;
pub mod tune;
pub mod verify;
