//! How the stages tell how far they are.

/// Receives the progress of a bake or a render. All methods may be called from several threads.
pub trait Progress: Sync {
    /// A stage of `length` steps begins; the one before it has ended.
    fn begin(&self, stage: &'static str, length: u64);
    /// That many more steps are done.
    fn advance(&self, steps: u64);
    /// True once the result is not wanted any more, and from then on. A bake asks between its stages and often within the long ones, so an
    /// answer should cost no more than reading a flag.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Tells nobody.
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _stage: &'static str, _length: u64) {}
    fn advance(&self, _steps: u64) {}
}
