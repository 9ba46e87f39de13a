//! The Pareto front of a method: the settings for which no other is both faster and closer to the truth.

/// One setting of a method, measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time of a frame, seconds, 0 or more.
    pub seconds: f64,
    /// Error, 0 or more.
    pub error: f64,
    /// False if the truth is too noisy to judge this error.
    pub suffices: bool,
}

/// What a front says between its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Seconds or error, whichever was asked for.
    pub value: f64,
    /// False if a sample that it rests on was judged by a truth that does not suffice.
    pub suffices: bool,
}

/// Below these, logarithms take the value for no time and no error.
const LEAST: f64 = 1e-12;

/// Indices of the samples on the front, from fast and wrong to slow and right. Of equal ones the first stays.
#[must_use]
pub fn front(samples: &[Sample]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let key = |i: usize| (samples[i].seconds, samples[i].error);
    order.sort_by(|&a, &b| key(a).0.total_cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1)));
    let mut best = f64::INFINITY;
    order.retain(|&i| {
        let better = samples[i].error < best;
        best = best.min(samples[i].error);
        better
    });
    order
}

/// The samples on the front, in its order.
#[must_use]
pub fn front_samples(samples: &[Sample]) -> Vec<Sample> {
    front(samples).into_iter().map(|i| samples[i]).collect()
}

/// The smallest error within a time, on straight lines between the front's samples in log-log; what the slowest sample
/// reaches holds for all the time beyond. `None` if even the fastest takes longer.
#[must_use]
pub fn error_within(front: &[Sample], seconds: f64) -> Option<Reading> {
    let next = front.partition_point(|sample| sample.seconds <= seconds);
    let before = front.get(next.checked_sub(1)?)?;
    let Some(after) = front.get(next) else {
        return Some(Reading { value: before.error, suffices: before.suffices });
    };
    let share = share_of(seconds, before.seconds, after.seconds);
    Some(between(share, (before, before.error), (after, after.error)))
}

/// The shortest time for an error, on straight lines between the front's samples in log-log; more error takes no less
/// than the fastest sample's time. `None` if even the slowest sample errs by more.
#[must_use]
pub fn seconds_to_reach(front: &[Sample], error: f64) -> Option<Reading> {
    let next = front.partition_point(|sample| sample.error > error);
    let after = front.get(next)?;
    let Some(before) = next.checked_sub(1).and_then(|i| front.get(i)) else {
        return Some(Reading { value: after.seconds, suffices: after.suffices });
    };
    let share = share_of(error, before.error, after.error);
    Some(between(share, (before, before.seconds), (after, after.seconds)))
}

fn log(value: f64) -> f64 {
    value.max(LEAST).ln()
}

fn share_of(value: f64, from: f64, to: f64) -> f64 {
    let length = log(to) - log(from);
    if length == 0.0 { 0.0 } else { (log(value) - log(from)) / length }
}

fn between(share: f64, (before, from): (&Sample, f64), (after, to): (&Sample, f64)) -> Reading {
    // At a sample its own value, to the bit, and its own truth.
    let (value, suffices) = if share <= 0.0 {
        (from, before.suffices)
    } else if share >= 1.0 {
        (to, after.suffices)
    } else {
        ((log(from) * (1.0 - share) + log(to) * share).exp(), before.suffices && after.suffices)
    };
    Reading { value, suffices }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(seconds: f64, error: f64) -> Sample {
        Sample { seconds, error, suffices: true }
    }

    /// Two on the front; the third is slower than the second and no better, the fourth slower and worse than the first.
    fn samples() -> [Sample; 4] {
        [sample(0.01, 0.4), sample(1.0, 0.1), sample(2.0, 0.1), sample(0.1, 0.5)]
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        assert_eq!(front(&samples()), [0, 1]);
        assert_eq!(front(&[sample(1.0, 0.2), sample(1.0, 0.1)]), [1]);
        assert_eq!(front(&[]), [0; 0]);
    }

    #[test]
    fn halfway_in_log_log_is_the_geometric_mean() {
        let front = front_samples(&samples());
        let error = error_within(&front, 0.1).unwrap();
        assert!((error.value - 0.2).abs() < 1e-12, "{error:?}");
        let seconds = seconds_to_reach(&front, 0.2).unwrap();
        assert!((seconds.value - 0.1).abs() < 1e-12, "{seconds:?}");
    }

    #[test]
    fn beyond_its_ends_a_front_promises_nothing_that_it_did_not_show() {
        let front = front_samples(&samples());
        assert_eq!(error_within(&front, 0.009), None);
        assert_eq!(error_within(&front, 0.01).unwrap().value, 0.4);
        assert_eq!(error_within(&front, 50.0).unwrap().value, 0.1);
        assert_eq!(seconds_to_reach(&front, 0.09), None);
        assert_eq!(seconds_to_reach(&front, 0.1).unwrap().value, 1.0);
        assert_eq!(seconds_to_reach(&front, 0.9).unwrap().value, 0.01);
        assert_eq!((error_within(&[], 1.0), seconds_to_reach(&[], 1.0)), (None, None));
    }

    #[test]
    fn a_reading_is_as_doubtful_as_what_it_rests_on() {
        let mut front = front_samples(&samples());
        front[1].suffices = false;
        assert!(error_within(&front, 0.01).unwrap().suffices);
        assert!(!error_within(&front, 0.1).unwrap().suffices);
        assert!(!error_within(&front, 9.0).unwrap().suffices);
    }

    #[test]
    fn no_time_and_no_error_have_a_place() {
        let front = [sample(0.0, 1.0), sample(1.0, 0.0)];
        assert!(error_within(&front, 0.5).unwrap().value < 1.0);
        assert_eq!(seconds_to_reach(&front, 0.0).unwrap().value, 1.0);
    }
}
