//! Runs programs that must keep within time and memory, and says what they took.

use std::fs::{self, File};
use std::io;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::device;

/// What a program may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Time of all its threads on the processor. Unlike the time on the clock it does not depend on what else the machine does.
    pub processor: Duration,
    /// Time on the clock, for a program that waits for ever.
    pub clock: Duration,
    /// The most memory that may be resident, bytes.
    pub memory: u64,
}

/// How a program ended.
#[derive(Debug)]
pub struct Finished {
    /// Its exit status.
    pub status: ExitStatus,
    /// What it wrote on stdout.
    pub stdout: String,
    /// What it wrote on stderr.
    pub stderr: String,
    /// Time on the processor, as last seen before the end; 0 where the system does not tell (it is Linux that does).
    pub processor: Duration,
    /// The most memory it had resident, bytes, likewise.
    pub memory: u64,
    /// The limit that it broke and was ended for.
    pub broke: Option<&'static str>,
}

/// How often a running program is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(4);

/// Runs a program to its end, or to the first limit that it breaks.
///
/// # Errors
/// If it cannot be started or watched.
pub fn run(command: &mut Command, limits: &Limits) -> io::Result<Finished> {
    let folder = tempfile::tempdir()?;
    let [out, err] = ["out", "err"].map(|name| folder.path().join(name));
    // Into files, since a full pipe would stop the program.
    let child =
        command.stdin(Stdio::null()).stdout(File::create(&out)?).stderr(File::create(&err)?).spawn()?;
    let finished = watch(child, limits)?;
    let text = |path| Ok::<_, io::Error>(String::from_utf8_lossy(&fs::read(path)?).into_owned());
    Ok(Finished { stdout: text(&out)?, stderr: text(&err)?, ..finished })
}

fn watch(mut child: Child, limits: &Limits) -> io::Result<Finished> {
    let start = Instant::now();
    let (mut processor, mut memory, mut broke) = (Duration::ZERO, 0, None);
    let status = loop {
        // A process that has ended tells nothing any more, so what it told last counts.
        memory = device::peak_memory_of(child.id()).unwrap_or(memory);
        processor = device::processor_time_of(child.id()).unwrap_or(processor);
        if let Some(status) = child.try_wait()? {
            break status;
        }
        let broken = [
            (processor > limits.processor, "processor"),
            (memory > limits.memory, "memory"),
            (start.elapsed() > limits.clock, "clock"),
        ];
        if let Some((_, name)) = broken.into_iter().find(|(broken, _)| *broken) {
            broke = Some(name);
            child.kill()?;
            break child.wait()?;
        }
        sleep(LOOK_EVERY);
    };
    Ok(Finished { status, stdout: String::new(), stderr: String::new(), processor, memory, broke })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits =
        Limits { processor: Duration::from_millis(300), clock: Duration::from_secs(60), memory: 64 << 20 };

    #[test]
    fn a_program_within_its_limits_ends_by_itself() {
        let script = "echo here; echo there >&2; exit 3";
        let finished = run(Command::new("sh").args(["-c", script]), &LIMITS).unwrap();
        assert_eq!((finished.status.code(), finished.broke), (Some(3), None));
        assert_eq!((finished.stdout.as_str(), finished.stderr.as_str()), ("here\n", "there\n"));
    }

    #[test]
    #[cfg_attr(not(target_os = "linux"), ignore = "only Linux tells")]
    fn a_program_that_breaks_a_limit_is_ended() {
        let mut endless = Command::new("sh");
        endless.args(["-c", "while :; do :; done"]);
        assert_eq!(run(&mut endless, &LIMITS).unwrap().broke, Some("processor"));
        // It looks for the last lines of an endless one.
        let mut greedy = Command::new("tail");
        greedy.arg("/dev/zero");
        let slow = Limits { processor: Duration::from_secs(60), ..LIMITS };
        let finished = run(&mut greedy, &slow).unwrap();
        assert_eq!(finished.broke, Some("memory"));
        assert!(finished.memory > LIMITS.memory);
        let short = Limits { clock: Duration::from_millis(50), ..LIMITS };
        assert_eq!(run(Command::new("sleep").arg("60"), &short).unwrap().broke, Some("clock"));
    }
}
