//! Distributions of errors that 1e9 cases fit into: logarithmic histograms with exact maxima.

/// Histogram steps per octave: quantiles are read to 4 %.
const STEPS: f64 = 16.0;
/// Errors below 2^-40 are as good as none.
const LOWEST_OCTAVE: f64 = -40.0;
const BUCKETS: usize = (80.0 * STEPS) as usize;

/// How often errors of each size occur.
#[derive(Clone, Debug)]
pub struct Errors {
    counts: Vec<u64>,
    /// Number of errors.
    pub count: u64,
    /// The largest, and the number of its case.
    pub max: (f64, u64),
}

impl Default for Errors {
    fn default() -> Self {
        Self { counts: vec![0; BUCKETS], count: 0, max: (0.0, 0) }
    }
}

impl Errors {
    /// Counts the error of case number `index`; NaN counts as infinite.
    pub fn add(&mut self, error: f64, index: u64) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        let bucket = ((error.log2() - LOWEST_OCTAVE) * STEPS).clamp(0.0, (BUCKETS - 1) as f64);
        if let Some(count) = self.counts.get_mut(bucket as usize) {
            *count += 1;
        }
        self.count += 1;
        if error > self.max.0 || self.count == 1 {
            self.max = (error, index);
        }
    }

    /// Adds another distribution to this one.
    pub fn merge(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
        self.count += other.count;
        if other.max.0 > self.max.0 {
            self.max = other.max;
        }
    }

    /// The error that a share `p` of all stay below; 0 without errors.
    #[must_use]
    pub fn quantile(&self, p: f64) -> f64 {
        let rank = (p * self.count as f64).ceil() as u64;
        let mut seen = 0;
        for (bucket, &count) in self.counts.iter().enumerate() {
            seen += count;
            if seen >= rank.max(1) {
                let upper = 2f64.powf((bucket as f64 + 1.0) / STEPS + LOWEST_OCTAVE);
                return upper.min(self.max.0);
            }
        }
        0.0
    }
}
