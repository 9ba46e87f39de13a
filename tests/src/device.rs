//! What measurements say about the machine that they were made on.

use std::fs;

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
    #[cfg_attr(not(target_os = "linux"), ignore = "only Linux tells")]
    fn memory_that_was_used_shows() {
        const BYTES: usize = 64 << 20;
        let before = peak_memory().unwrap();
        // Written, so that it becomes resident.
        let block = std::hint::black_box(vec![1u8; BYTES]);
        assert!(peak_memory().unwrap() >= (BYTES as u64).max(before), "{}", block.len());
    }
}
