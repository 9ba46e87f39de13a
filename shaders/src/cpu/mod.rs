//! The CPU mirrors, in the order in which data flows.
