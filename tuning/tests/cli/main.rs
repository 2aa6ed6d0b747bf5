//! The program as its users meet it: command lines in, text, files and exit codes out.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test stops at the first surprise")]

mod ask_tell;
mod bad_input;
mod commands;
mod common;
mod evaluate;
mod front;
mod resume;
mod story;
mod tune;
