//! Runs the program `vlm` as users and scripts do.

mod support;
mod bad_input;
mod baking;
mod authored;
mod commands;
