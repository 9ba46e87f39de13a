//! What measurements say about the machine that they were made on.

use std::fs;
use std::time::Duration;

/// The processor in its own words, where the system tells.
#[must_use]
pub fn processor() -> String {
    let told = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    told.unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// The most memory that this process ever had resident, bytes; `None` where the system does not tell (it is Linux that does).
#[must_use]
pub fn peak_memory() -> Option<u64> {
    peak_of(&fs::read_to_string("/proc/self/status").ok()?)
}

/// As [`peak_memory`], of another process while it runs.
#[must_use]
pub fn peak_memory_of(process: u32) -> Option<u64> {
    peak_of(&fs::read_to_string(format!("/proc/{process}/status")).ok()?)
}

/// How long all threads of a process have been on a processor; `None` where the system does not tell.
#[must_use]
pub fn processor_time_of(process: u32) -> Option<Duration> {
    ticks_of(&fs::read_to_string(format!("/proc/{process}/stat")).ok()?)
        .map(|ticks| Duration::from_secs_f64(ticks as f64 / TICKS_PER_SECOND))
}

/// Linux counts so to programs on every processor that it runs on, whatever its own clock does.
const TICKS_PER_SECOND: f64 = 100.0;

/// The 14th and 15th field, `utime` and `stime`; the second is a name in brackets that may hold anything.
fn ticks_of(stat: &str) -> Option<u64> {
    let after_name = stat.rsplit_once(')')?.1;
    let mut fields = after_name.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<u64>().ok();
    Some(next()? + next()?)
}

/// The line `VmHWM:   1234 kB` of a process' status, bytes.
fn peak_of(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_in_kibibytes() {
        assert_eq!(peak_of("Name:\tx\nVmPeak:\t 9 kB\nVmHWM:\t    1234 kB\n"), Some(1234 * 1024));
        assert_eq!(peak_of("Name:\tx\nVmPeak:\t 9 kB\n"), None, "the negative control");
        assert_eq!(peak_of("VmHWM:\t many kB\n"), None);
    }

    #[test]
    fn ticks_stand_behind_the_name() {
        let stat = "7 (a (b) c) S 1 7 7 0 -1 4194304 99 0 0 0 31 11 0 0 20 0 1 0 99 99 99";
        assert_eq!(ticks_of(stat), Some(42));
        assert_eq!(ticks_of("7 (a) S 1 7 7"), None, "the negative control");
    }

    #[test]
    #[cfg_attr(not(target_os = "linux"), ignore = "only Linux tells")]
    fn memory_that_was_used_shows() {
        const BYTES: usize = 64 << 20;
        let before = peak_memory().unwrap();
        // Written, so that it becomes resident.
        let block = std::hint::black_box(vec![1u8; BYTES]);
        assert!(peak_memory().unwrap() >= (BYTES as u64).max(before), "{}", block.len());
    }
}
